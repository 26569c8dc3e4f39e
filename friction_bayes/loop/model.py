"""The signal that a set of effects predicts for every record, and its derivatives in the coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.parameters import (
    Coordinate,
    effect_coordinates,
    physical_coordinates,
    scales_of,
)
from friction_bayes.loop.segment import Segment
from friction_bayes.mechanics.effects import (
    EFFECTS,
    ForceEffect,
    NoiseEffect,
    Scales,
    SensorEffect,
    force_offsets,
)
from friction_bayes.mechanics.integrate import propagator

__all__ = ["LoopModel", "Prediction", "changes_signal"]

RTOL = 1e-8
"""Local error of the integrator over the amplitude: 1e-7 after a hundred half cycles."""
_FIRST_STEP = 1e-3
"""Difference step in a coordinate before its posterior standard deviation is known."""
_SENSOR_STEP = 1e-7
_SOFT_SHARE = 0.1
"""Share of the sampling interval over which the acceleration jumps."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted signal.

    Attributes
    ----------
    clean : ndarray, shape (n,)
        What an ideal sensor shows.
    signal : ndarray, shape (n,)
        With the faults of the sensor that act before the noise.
    direction : ndarray, shape (n,)
        Sign of the velocity.
    turning_times, turning_points : ndarray
        Where the velocity is zero, and the displacement there.
    stop_time : float
        When the final rest begins; infinite where it still moves.
    """

    clean: Array
    signal: Array
    direction: Array
    turning_times: Array
    turning_points: Array
    stop_time: float


def changes_signal(name: str) -> bool:
    """Whether an effect changes the predicted signal: noise and what acts after it do not."""
    effect = EFFECTS[name]
    return not (isinstance(effect, NoiseEffect) or (isinstance(effect, SensorEffect) and effect.after_noise))


@dataclass(frozen=True, eq=False)
class LoopModel:
    """Coulomb friction on a spring with a set of effects, for some records of one system.

    Parameters
    ----------
    system : Oscillator
    segments : tuple of Segment
    effects : tuple of str
        Effects that change the signal.
    """

    system: Oscillator
    segments: tuple[Segment, ...]
    effects: tuple[str, ...] = ()
    coordinates: tuple[Coordinate, ...] = field(init=False)
    scales: Scales = field(init=False)
    durations: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        scales = scales_of(self.segments, self.system)
        found = physical_coordinates(scales, len(self.segments))
        for name in self.effects:
            found += effect_coordinates(name, scales, len(self.segments))
        object.__setattr__(self, "coordinates", found)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "durations", tuple(segment.duration for segment in self.segments))

    def shortened(self, samples: Sequence[int]) -> tuple[Segment, ...]:
        """The first samples of each segment."""
        return tuple(s.head(n) for s, n in zip(self.segments, samples, strict=True))

    def with_effects(self, names: Sequence[str]) -> LoopModel:
        """The same records with other effects, in the catalogue's order."""
        return LoopModel(self.system, self.segments, tuple(name for name in EFFECTS if name in names))

    def with_segments(self, segments: tuple[Segment, ...]) -> LoopModel:
        """The same model, priors included, of shortened records."""
        other = replace(self, segments=segments)
        object.__setattr__(other, "coordinates", self.coordinates)
        object.__setattr__(other, "scales", self.scales)
        object.__setattr__(other, "durations", self.durations)
        return other

    def physical(self, z: Array) -> Array:
        """Values of the coordinates."""
        return np.array([c.value(float(x)) for c, x in zip(self.coordinates, z, strict=True)])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Coordinates between which the force laws make sense, each of shape (p,)."""
        ends = np.array([c.coordinate_bounds for c in self.coordinates])
        return ends[:, 0], ends[:, 1]

    def within_bounds(self, z: Array) -> Array:
        """Move coordinates back to where the force laws make sense."""
        return np.clip(z, *self.bounds)

    def predict(self, z: Array, r: int, segment: Segment | None = None) -> Prediction | None:
        """Predict record ``r`` (or a shortened ``segment``); None when the motion does not stay finite."""
        seg = self.segments[r] if segment is None else segment
        return self.predict_at(z, r, seg.time)

    def predict_at(
        self,
        z: Array,
        r: int,
        time: Array,
        state: tuple[float, float] | None = None,
        order: int | None = None,
    ) -> Prediction | None:
        """Predict record ``r`` at any times; from another state, for another sensor where these are given."""
        value = self.physical(z)
        q = self.segments[r].order
        x0, v0 = (value[2 + 2 * r], value[3 + 2 * r]) if state is None else state
        ratio = math.exp(value[1])
        force, sensor = self._effect_values(value, r)
        status, x, v, a, times, points, stop = propagator(self.effects)(
            time,
            x0,
            v0,
            value[0],
            # the factor from the signal's friction coefficient to force stays that of the declared system
            self.system.moving * ratio ** (q - 2),
            self.system.stiffness * ratio**q,
            self.system.pendulum,
            self.durations[r],
            force,
            RTOL,
        )
        clean = (x, v, a)[q if order is None else order]
        if status == 0 and clean is a:
            _soften(a, time, times)
        if status != 0 or not math.isfinite(float(clean.sum())):
            return None
        return Prediction(clean, _sensed(clean, time, sensor), np.sign(v), times, points, float(stop))

    def _effect_values(self, value: Array, r: int) -> tuple[Array, dict[str, list[float]]]:
        offsets = force_offsets()
        force = np.zeros(sum(len(e.parameters) for e in EFFECTS.values() if isinstance(e, ForceEffect)))
        sensor: dict[str, list[float]] = {}
        at: dict[str, int] = {}
        for c, x in zip(self.coordinates, value, strict=True):
            if c.effect in offsets:
                force[offsets[c.effect] + at.get(c.effect, 0)] = x
                at[c.effect] = at.get(c.effect, 0) + 1
            elif c.effect and c.record == r:
                sensor.setdefault(c.effect, []).append(float(x))
        return force, sensor

    def derivatives(
        self, z: Array, r: int, base: Prediction, steps: Array | None = None, segment: Segment | None = None
    ) -> Array:
        """Derivatives of the signal of record ``r``, shape (n, p), by forward differences."""
        seg = self.segments[r] if segment is None else segment
        jacobian = np.zeros((seg.values.size, z.size))
        for j in range(z.size):
            c = self.coordinates[j]
            if c.record not in (-1, r):
                continue
            h = self.first_step(j) if steps is None or (c.effect and c.record >= 0) else float(steps[j])
            jacobian[:, j] = self.difference(z, j, h, r, base, seg)
        return jacobian

    def first_step(self, j: int) -> float:
        """Difference step of a coordinate before its posterior is known.

        A motion is known to the integrator's error; a sensor's term to rounding, and a line of
        interference bends within a thousandth of its prior range.
        """
        c = self.coordinates[j]
        return _SENSOR_STEP if c.effect and c.record >= 0 else _FIRST_STEP

    def difference(
        self, z: Array, j: int, h: float, r: int, base: Prediction, segment: Segment | None = None
    ) -> Array:
        """Derivative of the signal of record ``r`` in one coordinate, by a step ``h``."""
        seg = self.segments[r] if segment is None else segment
        moved = z.copy()
        moved[j] += h
        if self.coordinates[j].effect and self.coordinates[j].record >= 0:
            _, sensor = self._effect_values(self.physical(moved), r)
            return (_sensed(base.clean, seg.time, sensor) - base.signal) / h
        other = self.predict(moved, r, seg)
        if other is None:
            moved[j] = z[j] - h
            other, h = self.predict(moved, r, seg), -h
            if other is None:
                return np.zeros(seg.values.size)
        column = (other.signal - base.signal) / h
        if seg.order == 2:
            # where a turning point passes a sample the acceleration jumps: no derivative there
            crossed = other.direction != base.direction
            if crossed.any() and not crossed.all():
                kept = np.flatnonzero(~crossed)
                column[crossed] = np.interp(np.flatnonzero(crossed), kept, column[kept])
        return column


def _soften(acceleration: Array, time: Array, turns: Array) -> None:
    """Spread the jump at each turning point over a small share of the sampling interval, in place.

    A sample that lies that close to a turning point says which side it is on with less certainty than the
    sampling clock has; and a likelihood without steps can be climbed.
    """
    if time.size < 3:
        return
    step = time[1] - time[0]
    at = np.rint((turns - time[0]) / step).astype(int)
    inside = (at > 0) & (at < time.size - 1)
    j, turn = at[inside], turns[inside]
    s = (time[j] - turn) / (_SOFT_SHARE * step)
    near = np.abs(s) < 1.0
    j, s = j[near], s[near]
    jump = acceleration[j + 1] - acceleration[j - 1]
    acceleration[j] += np.where(s < 0.0, 0.5 + 0.5 * s, 0.5 * s - 0.5) * jump


def _sensed(clean: Array, time: Array, sensor: dict[str, list[float]]) -> Array:
    signal = clean
    for name, numbers in sensor.items():
        effect = EFFECTS[name]
        assert isinstance(effect, SensorEffect)
        signal = effect.distort(signal, time, *numbers)
    return signal
