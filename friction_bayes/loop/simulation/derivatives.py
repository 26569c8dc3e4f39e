"""Derivatives of the predicted signal in the coordinates, by forward differences."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction, sensor_output
from friction_bayes.loop.data.parameters import SHARED
from friction_bayes.loop.data.prepared_record import Segment

__all__ = ["derivative", "first_step", "signal_derivatives"]

_FIRST_STEP = 1e-3
"""Difference step in a coordinate before its posterior standard deviation is known."""
_SENSOR_STEP = 1e-7


def signal_derivatives(
    model: LoopModel,
    z: Array,
    r: int,
    base: Prediction,
    *,
    steps: Array | None = None,
    segment: Segment | None = None,
) -> Array:
    """Derivatives of the signal of record ``r``, shape (n, p).

    Parameters
    ----------
    model : LoopModel
    z : ndarray, shape (p,)
    r : int
    base : Prediction
        Of the record at ``z``.
    steps : ndarray, shape (p,), optional
        Difference steps of the coordinates of the motion.
    segment : Segment, optional
        The first part of the record, where only that was predicted.
    """
    seg = model.segments[r] if segment is None else segment
    jacobian = np.zeros((seg.values.size, z.size))
    for j, c in enumerate(model.coordinates):
        if c.record in (SHARED, r):
            step = first_step(model, j) if steps is None or c.is_sensor else float(steps[j])
            jacobian[:, j] = derivative(model, z, r, j, step, base, seg)
    return jacobian


def first_step(model: LoopModel, j: int) -> float:
    """Difference step of a coordinate before its posterior is known.

    A motion is known to the integrator's error; a sensor's term to rounding, and a line of
    interference bends within a thousandth of its prior range.
    """
    return _SENSOR_STEP if model.coordinates[j].is_sensor else _FIRST_STEP


def derivative(
    model: LoopModel,
    z: Array,
    r: int,
    j: int,
    step: float,
    base: Prediction,
    segment: Segment | None = None,
) -> Array:
    """Derivative of the signal of record ``r`` in coordinate ``j``, shape (n,)."""
    seg = model.segments[r] if segment is None else segment
    moved = z.copy()
    moved[j] += step
    if model.coordinates[j].is_sensor:
        # the motion stays as it is
        signal = sensor_output(base.clean, seg.time, model.record_parameters(moved, r).effects)
        return (signal - base.signal) / step
    other = model.predict(moved, r, seg)
    if other is None:
        moved[j] = z[j] - step
        other, step = model.predict(moved, r, seg), -step
        if other is None:
            return np.zeros(seg.values.size)
    column = (other.signal - base.signal) / step
    if seg.order == 2:
        # where a turning point passes a sample the acceleration jumps: no derivative there
        crossed = other.direction != base.direction
        if crossed.any() and not crossed.all():
            kept = np.flatnonzero(~crossed)
            column[crossed] = np.interp(np.flatnonzero(crossed), kept, column[kept])
    return column
