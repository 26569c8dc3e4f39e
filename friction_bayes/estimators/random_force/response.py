r"""What an oscillator at rest answers to a force given along a path, at the sensor.

Over an interval ``h`` the state ``z = (x, v)`` takes

.. math:: z(h) = F(h) z(0) + \int_0^h F(h-s)\,(0, \phi(s))'\,ds

with the free motion ``F`` of the damped oscillator, and the integral is the quadrature of
:mod:`friction_bayes.estimators.random_force.measured_path`. A sensor of displacement or velocity reads the
state; an accelerometer reads ``-x - 2 zeta v + phi``.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.estimators.random_force.measured_path import MeasuredPath

__all__ = ["at_sensor", "force_response", "initial_response"]


def force_response(path: MeasuredPath, forces: Array, zeta: float = 0.0) -> Array:
    """Displacement and velocity, shape (n, 2, p), answered to forces at a path's nodes, shape (m, p)."""
    forces = np.ascontiguousarray(forces, dtype=np.float64)
    return _accumulate(path.phase, path.interval, path.node_phase, path.node_weight, forces, zeta)


def initial_response(phase: Array, zeta: float = 0.0) -> Array:
    """Displacement and velocity, shape (n, 2, 2), that follow from a unit of each at the first sample."""
    s = phase - phase[0]
    omega = math.sqrt(1.0 - zeta * zeta)
    decay, cosine, sine = np.exp(-zeta * s), np.cos(omega * s), np.sin(omega * s) / omega
    states = np.empty((phase.size, 2, 2))
    states[:, 0, 0] = decay * (cosine + zeta * sine)
    states[:, 1, 0] = -decay * sine
    states[:, 0, 1] = decay * sine
    states[:, 1, 1] = decay * (cosine - zeta * sine)
    return states


def at_sensor(states: Array, row: Array, forces: Array | None = None) -> Array:
    """Sensor output, shape (n, p).

    Parameters
    ----------
    states : ndarray, shape (n, 2, p)
        Displacement and velocity.
    row : ndarray, shape (3,)
        From :func:`friction_bayes.estimators.random_force.whitening.sensor_row`.
    forces : ndarray, optional, shape (n, p)
        Forces at the samples, which an accelerometer reads; at a turning point, the mean over the
        uncertainty of the velocity.
    """
    out = row[0] * states[:, 0] + row[1] * states[:, 1]
    return out if forces is None else out + row[2] * forces


@njit(cache=True, nogil=True)
def _accumulate(
    phase: Array, interval: Indices, node_phase: Array, weight: Array, forces: Array, zeta: float
) -> Array:
    n, (m, p) = phase.size, forces.shape
    states = np.zeros((n, 2, p))
    omega = math.sqrt(1.0 - zeta * zeta)
    k = 0
    for i in range(n - 1):
        h = phase[i + 1] - phase[i]
        decay, cosine, sine = math.exp(-zeta * h), math.cos(omega * h), math.sin(omega * h) / omega
        xx, xv, vv = decay * (cosine + zeta * sine), decay * sine, decay * (cosine - zeta * sine)
        for j in range(p):
            states[i + 1, 0, j] = xx * states[i, 0, j] + xv * states[i, 1, j]
            states[i + 1, 1, j] = -xv * states[i, 0, j] + vv * states[i, 1, j]
        while k < m and interval[k] == i:
            left = phase[i + 1] - node_phase[k]
            decay = weight[k] * math.exp(-zeta * left)
            sine = math.sin(omega * left) / omega
            to_x, to_v = decay * sine, decay * (math.cos(omega * left) - zeta * sine)
            for j in range(p):
                states[i + 1, 0, j] += to_x * forces[k, j]
                states[i + 1, 1, j] += to_v * forces[k, j]
            k += 1
    return states
