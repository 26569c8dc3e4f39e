"""A predicted signal with its derivatives in the coordinates of the model: the chain rule."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction, RecordParameters, as_sensed, sensor_output
from friction_bayes.loop.data.parameters import DISPLACEMENT, FRICTION, SHARED, VELOCITY, Coordinate
from friction_bayes.mechanics import sensitivities
from friction_bayes.mechanics.effects import EFFECTS, SensorEffect, force_offsets
from friction_bayes.mechanics.integrate import propagator_with_columns

__all__ = ["predict_with_derivatives"]

_SENSOR_STEP = 1e-7
"""Difference step in a coordinate of the sensor: a line bends within a thousandth of its prior range."""
_SIGNAL_STEP = 1e-6
"""Difference step in the signal that the sensor distorts, over its largest value."""
_STATE = {
    DISPLACEMENT: sensitivities.DISPLACEMENT,
    VELOCITY: sensitivities.VELOCITY,
    FRICTION: sensitivities.FRICTION,
}


def predict_with_derivatives(
    model: LoopModel,
    z: Array,
    r: int,
    time: Array | None = None,
    *,
    coordinates: Sequence[int] | None = None,
    state: tuple[float, float] | None = None,
    order: int | None = None,
) -> tuple[Prediction, Array] | None:
    """Predict record ``r`` and the derivatives of its signal, in one pass.

    Parameters
    ----------
    model : LoopModel
    z : ndarray, shape (p,)
    r : int
    time : ndarray, shape (n,), optional
        Seconds since the start of the segment; by default its samples.
    coordinates : sequence of int, optional
        In which derivatives are wanted, q of them; by default all.
    state, order
        As :meth:`friction_bayes.loop.data.model.LoopModel.predict_at` has them.

    Returns
    -------
    prediction : Prediction
    derivatives : ndarray, shape (n, q)
        Zero in what belongs to another record.

    None when the motion does not stay finite.
    """
    time = model.segments[r].time if time is None else time
    order = model.segments[r].order if order is None else order
    values = model.record_parameters(z, r)
    wanted = range(z.size) if coordinates is None else coordinates
    own = {k: j for k, j in enumerate(wanted) if model.coordinates[j].record in (SHARED, r)}
    terms = {
        k: list(_terms(model, model.coordinates[j], float(z[j]), values))
        for k, j in own.items()
        if not model.coordinates[j].is_sensor
    }
    numbers = sorted({number for parts in terms.values() for number, _ in parts})
    motion, columns = propagator_with_columns(model.effects)(
        *model.motion_arguments(values, r, time, state, order), np.array(numbers, dtype=np.int64)
    )
    prediction = as_sensed(motion, time, order, values.effects)
    if prediction is None:
        return None
    derivatives = np.zeros((time.size, len(wanted)), order="F")
    gain = _gain(prediction.clean, time, values.effects)
    for k, parts in terms.items():
        for number, slope in parts:
            derivatives[:, k] += slope * gain * columns[numbers.index(number)]
    for k in own.keys() - terms.keys():
        derivatives[:, k] = _of_sensor(model, z, r, own[k], prediction.clean, time)
    return (prediction, derivatives) if np.isfinite(derivatives).all() else None


def _terms(
    model: LoopModel, c: Coordinate, z: float, values: RecordParameters
) -> Iterator[tuple[int, float]]:
    """Number of each column of the motion that a coordinate moves, and how much it does."""
    slope = c.slope(z)
    if c.effect:
        # what makes the noise moves no column
        if c.effect in force_offsets():
            names = [parameter.name for parameter in EFFECTS[c.effect].parameters]
            yield sensitivities.OWN + force_offsets()[c.effect] + names.index(c.name), slope
    elif c.name in _STATE:
        yield _STATE[c.name], slope
    else:
        # the logarithm of the frequency, see LoopModel.mass_and_stiffness
        order = model.segments[0].order
        mass, stiffness = model.mass_and_stiffness(values.frequency_ratio)
        for number, share in (
            (sensitivities.MASS, (order - 2) * mass),
            (sensitivities.STIFFNESS, order * stiffness),
        ):
            if share:
                yield number, slope * share


def _gain(clean: Array, time: Array, effects: Mapping[str, tuple[float, ...]]) -> Array | float:
    """Derivative of what the sensor shows in the clean signal at each sample, shape (n,).

    On which side a sensor with hysteresis is held does not change with it.
    """
    if not any(isinstance(EFFECTS[name], SensorEffect) for name in effects):
        return 1.0
    step = _SIGNAL_STEP * (float(np.abs(clean).max()) or 1.0)
    more, less = (sensor_output(clean + way * step, time, effects) for way in (1.0, -1.0))
    return np.asarray((more - less) / (2.0 * step))


def _of_sensor(model: LoopModel, z: Array, r: int, j: int, clean: Array, time: Array) -> Array:
    """Derivative of what the sensor shows of a clean signal in a coordinate of its own, shape (n,)."""
    shown = []
    for way in (1.0, -1.0):
        moved = z.copy()
        moved[j] += way * _SENSOR_STEP
        shown.append(sensor_output(clean, time, model.record_parameters(moved, r).effects))
    return np.asarray((shown[0] - shown[1]) / (2.0 * _SENSOR_STEP))
