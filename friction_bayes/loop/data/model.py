"""The signal that Coulomb friction with a set of effects predicts for every record, and its derivatives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.data.parameters import (
    DISPLACEMENT,
    FRICTION,
    LOG_FREQUENCY_RATIO,
    SHARED,
    VELOCITY,
    Coordinate,
    effect_coordinates,
    physical_coordinates,
    scales_of,
)
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.mechanics.effects import (
    EFFECTS,
    Scales,
    SensorEffect,
    force_vector,
)
from friction_bayes.mechanics.integrate import propagator

__all__ = ["LoopModel", "Prediction", "difference_steps", "prediction_derivatives"]

_RTOL = 1e-8
"""Local error of the integrator over the amplitude: 1e-7 after a hundred half cycles."""
_FIRST_STEP = 1e-3
"""Difference step in a coordinate before its posterior standard deviation is known."""
_STEP_SHARE = 0.2
"""Difference step in posterior standard deviations: far above rounding, far below curvature."""
_SENSOR_STEP = 1e-7
"""Difference step of a sensor's term, which is known to rounding."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted signal of n samples, ``clean`` of an ideal sensor, with effects that act before the noise.

    With the motion, where its velocity is zero, and when the final rest begins; infinite where it still
    moves.
    """

    clean: Array
    signal: Array
    displacement: Array
    velocity: Array
    turning_times: Array
    turning_points: Array
    stop_time: float


@dataclass(frozen=True, eq=False)
class LoopModel:
    """Coulomb friction on a spring with a set of effects, for some records of one system.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment
    effects : tuple of str
        Effects that change the signal, in the catalogue's order.
    """

    system: Oscillator
    segments: tuple[Segment, ...]
    effects: tuple[str, ...] = ()

    @cached_property
    def scales(self) -> Scales:
        """Scales of the priors."""
        return scales_of(self.segments, self.system)

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The parameters: friction and frequency, initial states, then those of each effect."""
        records = len(self.segments)
        return physical_coordinates(self.scales, records) + tuple(
            c for name in self.effects for c in effect_coordinates(name, self.scales, records)
        )

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the coordinates in a fit, each of shape (p,)."""
        ends = np.array([c.bounds for c in self.coordinates])
        return ends[:, 0], ends[:, 1]

    def within_bounds(self, z: Array) -> Array:
        """Coordinates moved back within their bounds."""
        return np.clip(z, *self.bounds)

    def index(self, name: str, *, effect: str = "", record: int = SHARED) -> int:
        """Position of a parameter in the vector of coordinates."""
        wanted = effect, name, record
        return next(j for j, c in enumerate(self.coordinates) if (c.effect, c.name, c.record) == wanted)

    def value(self, z: Array, name: str) -> Array:
        """Value of a parameter of the law at coordinates of shape (..., p)."""
        j = self.index(name)
        return np.asarray(self.coordinates[j].value(z[..., j]))

    def coordinates_of(self, values: Mapping[tuple[str, str], Iterable[float]], count: int) -> Array:
        """Coordinates of ``count`` draws of some parameters, by effect and name; zero of others."""
        z = np.zeros((count, len(self.coordinates)))
        for j, c in enumerate(self.coordinates):
            if (c.effect, c.name) in values:
                z[:, j] = [c.coordinate(float(value)) for value in values[c.effect, c.name]]
        return z

    def values(self, z: Array, r: int) -> tuple[dict[str, float], dict[str, tuple[float, ...]]]:
        """Values of the parameters that act on record ``r``, by name, and those of each effect, in order."""
        own: dict[str, float] = {}
        effects: dict[str, tuple[float, ...]] = {}
        for c, x in zip(self.coordinates, z, strict=True):
            if c.record not in (SHARED, r):
                continue
            value = float(c.value(float(x)))
            if c.effect:
                effects[c.effect] = (*effects.get(c.effect, ()), value)
            else:
                own[c.name] = value
        return own, effects

    def mass_and_stiffness(self, ratio: float) -> tuple[float, float]:
        """Mass and stiffness of a system whose frequency is ``ratio`` times the declared one.

        The factor from the signal's friction coefficient to force stays that of the declared system: the
        stiffness where displacement is measured, the mass where acceleration is.
        """
        order = self.segments[0].order
        return self.system.moving * ratio ** (order - 2), self.system.stiffness * ratio**order

    def of_first_samples(self, samples: Sequence[int]) -> LoopModel:
        """The same model, priors included, of the first samples of each record."""
        heads = tuple(s.head(n) for s, n in zip(self.segments, samples, strict=True))
        return replace(self, segments=heads)

    def predict(self, z: Array, r: int) -> Prediction | None:
        """Prediction of record ``r``; None when the motion is not finite."""
        return self.predict_at(z, r, self.segments[r].time)

    def predict_at(
        self,
        z: Array,
        r: int,
        time: Array,
        state: tuple[float, float] | None = None,
        order: int | None = None,
    ) -> Prediction | None:
        """Prediction of record ``r`` at any times since its start [s]; None where it is not finite.

        From another ``state`` than the fitted one, displacement and velocity at the first of these times, and
        for a sensor of another derivative ``order``, if given.
        """
        if order is None:
            order = self.segments[r].order
        own, effects = self.values(z, r)
        displacement, velocity = (own[DISPLACEMENT], own[VELOCITY]) if state is None else state
        mass, stiffness = self.mass_and_stiffness(math.exp(own[LOG_FREQUENCY_RATIO]))
        status, x, v, a, times, points, stop = propagator(self.effects)(
            time,
            displacement,
            velocity,
            own[FRICTION],
            mass,
            stiffness,
            self.system.pendulum,
            self.segments[r].duration,
            force_vector(effects),
            _RTOL,
            order,
        )
        clean = (x, v, a)[order]
        if status != 0 or not math.isfinite(float(clean.sum())):
            return None
        signal = sensor_output(clean, time, effects)
        return Prediction(clean, signal, x, v, times, points, float(stop))


def sensor_output(clean: Array, time: Array, effects: Mapping[str, tuple[float, ...]]) -> Array:
    """A clean signal as read by the sensor, with those of the effects that are sensor effects."""
    signal = clean
    for name, values in effects.items():
        effect = EFFECTS[name]
        if isinstance(effect, SensorEffect):
            signal = effect.distort(signal, time, *values)
    return signal


def difference_steps(precision: Array) -> Array:
    """A share of each coordinate's standard deviation with the others held, within sane bounds."""
    return np.clip(_STEP_SHARE / np.sqrt(np.diag(precision)), 1e-7, 1e-2)


def prediction_derivatives(
    model: LoopModel, z: Array, r: int, base: Prediction, steps: Array | None
) -> Array:
    """Derivatives of the signal of record ``r`` at ``z``, shape (n, p), about its prediction there.

    Difference ``steps``, shape (p,), are of the coordinates of the motion; None before any posterior is
    known.
    """
    columns = np.zeros((base.signal.size, z.size))
    for j, c in enumerate(model.coordinates):
        if c.record not in (SHARED, r):
            continue
        if isinstance(EFFECTS.get(c.effect), SensorEffect):
            columns[:, j] = _of_sensor(model, z, r, j, base)
        else:
            columns[:, j] = _of_motion(model, z, r, j, _FIRST_STEP if steps is None else steps[j], base)
    return columns


def _of_sensor(model: LoopModel, z: Array, r: int, j: int, base: Prediction) -> Array:
    """Derivative in a coordinate of the sensor: the motion stays as it is."""
    moved = z.copy()
    moved[j] += _SENSOR_STEP
    _, effects = model.values(moved, r)
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
