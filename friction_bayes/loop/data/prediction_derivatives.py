"""Derivatives of the predicted signal in the coordinates, by forward differences."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction, sensor_output
from friction_bayes.loop.data.parameters import SHARED

__all__ = ["difference_steps", "prediction_derivatives"]

_FIRST_STEP = 1e-3
"""Difference step in a coordinate before its posterior standard deviation is known."""
_STEP_SHARE = 0.2
"""Difference step in posterior standard deviations: far above rounding, far below curvature."""
_SENSOR_STEP = 1e-7
"""Difference step of a sensor's term, which is known to rounding."""


def difference_steps(precision: Array) -> Array:
    """A share of each coordinate's standard deviation with the others held, within sane bounds."""
    return np.clip(_STEP_SHARE / np.sqrt(np.diag(precision)), 1e-7, 1e-2)


def prediction_derivatives(
    model: LoopModel, z: Array, r: int, base: Prediction, steps: Array | None
) -> Array:
    """Derivatives of the signal of record ``r``, shape (n, p).

    Parameters
    ----------
    model : LoopModel
    z : ndarray, shape (p,)
    r : int
    base : Prediction
        Of the record at ``z``.
    steps : ndarray, shape (p,), or None
        Difference steps of the coordinates of the motion; None before any posterior is known.
    """
    columns = np.zeros((base.signal.size, z.size))
    for j, c in enumerate(model.coordinates):
        if c.record not in (SHARED, r):
            continue
        if c.is_sensor:
            columns[:, j] = _of_sensor(model, z, r, j, base)
        else:
            columns[:, j] = _of_motion(model, z, r, j, _FIRST_STEP if steps is None else steps[j], base)
    return columns


def _of_sensor(model: LoopModel, z: Array, r: int, j: int, base: Prediction) -> Array:
    """Derivative in a coordinate of the sensor: the motion stays as it is."""
    moved = z.copy()
    moved[j] += _SENSOR_STEP
    effects = model.record_parameters(moved, r).effects
    return (sensor_output(base.clean, model.segments[r].time, effects) - base.signal) / _SENSOR_STEP


def _of_motion(model: LoopModel, z: Array, r: int, j: int, step: float, base: Prediction) -> Array:
    """Derivative in a coordinate of the motion; zero where that does not stay finite on either side."""
    moved = z.copy()
    moved[j] += step
    other = model.predict(moved, r)
    if other is None:
        moved[j], step = z[j] - step, -step
        other = model.predict(moved, r)
        if other is None:
            return np.zeros(base.signal.size)
    column = (other.signal - base.signal) / step
    if model.segments[r].order == 2:
        # where a turning point passes a sample the acceleration jumps: no derivative there
        crossed = np.sign(other.velocity) != np.sign(base.velocity)
        if crossed.any() and not crossed.all():
            kept = np.flatnonzero(~crossed)
            column[crossed] = np.interp(np.flatnonzero(crossed), kept, column[kept])
    return np.asarray(column)
