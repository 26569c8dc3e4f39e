r"""What an oscillator at rest answers to a force given along a path, at the sensor.

Over an interval ``h`` the state ``z = (x, v)`` takes

.. math:: z(h) = F(h) z(0) + \int_0^h F(h-s)\,(0, \phi(s))'\,ds

with the free motion ``F`` of the oscillator, and the integral is the quadrature of
:mod:`friction_bayes.statespace.measured_path`, which also says how stiff the oscillator is over
each interval. A sensor of displacement or velocity reads the state; an accelerometer reads ``-x + phi``, or
``-kappa x + phi`` with the slope ``kappa`` of a pendulum's restoring force at the sample.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.transition import free_motion

__all__ = ["at_sensor", "force_response"]


def force_response(path: MeasuredPath, forces: Array) -> Array:
    """Displacement and velocity, shape (n, 2, p), answered to forces at a path's nodes, shape (m, p)."""
    forces = np.ascontiguousarray(forces, dtype=np.float64)
    states = np.zeros((path.phase.size, 2, forces.shape[1]))
    _accumulate(path.phase, path.stiffness, path.interval, path.node_phase, path.node_weight, forces, states)
    return states


def at_sensor(states: Array, row: Array, forces: Array | None = None) -> Array:
    """Sensor output, shape (n, p).

    Parameters
    ----------
    states : ndarray, shape (n, 2, p)
        Displacement and velocity.
    row : ndarray, shape (3,) or (n, 3)
        From :func:`friction_bayes.statespace.kalman.sensor_row`.
    forces : ndarray, optional, shape (n, p)
        Forces at the samples, which an accelerometer reads; at a turning point, the mean over the
        uncertainty of the velocity.
    """
    out = row[..., :1] * states[:, 0] + row[..., 1:2] * states[:, 1]
    return out if forces is None else out + row[..., 2:] * forces


@njit(cache=True, nogil=True)
def _accumulate(
    phase: Array,
    stiffness: Array,
    interval: Indices,
    node_phase: Array,
    weight: Array,
    forces: Array,
    states: Array,
) -> None:
    """Fill the states, shape (n, 2, p), from the first on."""
    m, p = forces.shape
    k = 0
    for i in range(phase.size - 1):
        cosine, sine = free_motion(phase[i + 1] - phase[i], stiffness[i])
        back = -stiffness[i] * sine
        for j in range(p):
            states[i + 1, 0, j] = cosine * states[i, 0, j] + sine * states[i, 1, j]
            states[i + 1, 1, j] = back * states[i, 0, j] + cosine * states[i, 1, j]
        while k < m and interval[k] == i:
            to_v, to_x = free_motion(phase[i + 1] - node_phase[k], stiffness[i])
            for j in range(p):
                states[i + 1, 0, j] += weight[k] * to_x * forces[k, j]
                states[i + 1, 1, j] += weight[k] * to_v * forces[k, j]
            k += 1
