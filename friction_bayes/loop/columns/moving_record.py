"""A record while it moves, how it was recorded, and the effects that may act."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.noise.free_corners import near_corners
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, determined
from friction_bayes.loop.columns.effect_columns import OF_LINES, LawColumn
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.correlated_noise import NO_ERROR, Colour, SensorError
from friction_bayes.mechanics.effects import (
    EFFECTS,
    ForceEffect,
    Scales,
    SensorEffect,
    in_catalogue_order,
)
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING
from friction_bayes.mechanics.pendulum import frequency_ratio
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.response import Feedback, feedback_steps
from friction_bayes.statespace.smoother import MOTION_KNOWN_TO, SmoothedMotion, first_motion

__all__ = ["MovingRecord", "why_not_evaluated"]

_LEFT_OUT = 1.5
"""Half cycles before a motion stops that are left out: it ends between two turning points then, neither of
which is in doubt."""


@dataclass(frozen=True, eq=False)
class MovingRecord:
    """The samples of a record while it moves, and the effects that may act.

    Attributes
    ----------
    segment : Segment
    samples : int
        How many of its samples are used.
    system : Oscillator
    allowed : tuple of str
        Effects that may act, of the law and of the noise.
    scales : Scales
        Of the priors.
    variance : ndarray, shape (samples,)
        Noise variances of the samples relative to each other, infinite for those that are not fitted.
    noise : {"auto", "white", "ar"}
        Noise of the sensor: white or what it shows, white, or coloured where it can be.
    forced : bool
        Whether a random force may act.
    error : SensorError or Colour
        The noise that neighbouring samples share.
    sizes : dict
        Approximate size of the sensor effects whose size shapes them, by effect.
    scores : dict
        Where the shapes of forces are taken, as normal scores of their priors, by effect; all over the prior
        where it has none.
    filter : RecordingFilter or None
        Through which the record went. No random force is evaluated behind one.
    free_corners : bool
        Whether the corners of what is recorded may have any shape.
    jump : ndarray or None, shape (samples - 1,)
        How far the random force may jump in each interval in addition to its own increment, over the noise;
        None where it may nowhere.
    """

    segment: Segment
    samples: int
    system: Oscillator
    allowed: tuple[str, ...]
    scales: Scales
    variance: Array
    noise: str = "auto"
    forced: bool = True
    error: SensorError | Colour = NO_ERROR
    sizes: dict[str, float] = field(default_factory=dict)
    scores: dict[str, tuple[float, ...]] = field(default_factory=dict)
    filter: RecordingFilter | None = None
    free_corners: bool = False
    jump: Array | None = None

    @classmethod
    def of(
        cls,
        segment: Segment,
        system: Oscillator,
        allowed: Sequence[str],
        scales: Scales,
        *,
        noise: str = "auto",
        samples: int | None = None,
    ) -> MovingRecord:
        """Leave out the last half cycle of a motion that stops."""
        n = _moving(segment) if samples is None else samples
        variance = np.where(segment.free, segment.variance, np.inf)[:n]
        names = in_catalogue_order(allowed)
        return cls(segment, n, system, names, scales, variance, noise, RANDOM_FORCE.name in allowed)

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Those of the law: forces, lines and linear sensor effects, which are evaluated along a motion."""
        return tuple(
            name
            for name in self.allowed
            if isinstance(EFFECTS[name], ForceEffect | SensorEffect)
            and name != SENSOR_CLIPPING.name
            and not why_not_evaluated(name, self.segment, self.scales)
        )

    def setting_aside(self, samples: Mask) -> MovingRecord:
        """The same without some more samples, shape (n,)."""
        return replace(self, variance=np.where(samples, np.inf, self.variance))

    def behind(self, filter_: RecordingFilter) -> MovingRecord:
        """The same behind a filter, without the samples at either end, where its response is unknown.

        With those next to jumps of an acceleration, which it has rounded. The force may no longer jump.
        """
        behind = replace(self, filter=filter_, forced=False, jump=None)
        variance, inside = np.full(self.samples, np.inf), behind.known
        variance[inside] = self._with_jumps[inside]
        return replace(behind, variance=variance)

    @property
    def _with_jumps(self) -> Array:
        """Relative variances with samples next to jumps of the acceleration, shape (n,)."""
        segment, n = self.segment, self.samples
        return np.where(segment.near_jumps[:n], segment.variance[:n], self.variance)

    @property
    def known(self) -> slice:
        """The samples that the motion within the record determines, see :func:`.determined`."""
        return determined(self.filter, self.samples)

    def of_one_column(self, law: Sequence[LawColumn]) -> MovingRecord:
        """The same without effects that have several columns in a law, or none."""
        columns = Counter(column.effect for column in law)
        return self.without_effects({name for name in self.effects if columns[name] != 1})

    def without_effects(self, names: Collection[str]) -> MovingRecord:
        """The same where these may not act."""
        return replace(self, allowed=tuple(name for name in self.allowed if name not in names))

    def signal(self, w0: float) -> Array:
        """The samples in natural units of a frequency, shape (n,)."""
        return self.segment.values[: self.samples] / w0**self.segment.order

    @property
    def least_noise(self) -> float:
        """Of the sensor's rounding, and at least what the interpolated motion is known to, its unit."""
        return max(self.segment.least_noise, MOTION_KNOWN_TO * self.scales.signal)

    def phase(self, w0: float) -> Array:
        """Their time stamps in natural units of a frequency, shape (n,)."""
        return np.asarray(w0 * self.segment.time[: self.samples])

    def clock_along(self, path: MeasuredPath, feedback: Feedback, w0: float) -> Clock:
        """Their time stamps and noise, and the propagation of a perturbation by oscillator and law."""
        steps, variance = feedback_steps(path, feedback) if self.forced else None, self.variance
        if self.free_corners and self.segment.order == 2:
            # the columns of corners do not represent a jump
            variance = np.where(near_corners(path), np.inf, variance)
        return self.error.of(Clock.of(path.phase, variance, path.stiffness, self.jump, steps), w0)

    def first_motion(self) -> tuple[float, SmoothedMotion]:
        """The frequency of small swings [rad/s] and the motion, in its units, before any law is known.

        With the values next to the jumps of an acceleration: without a law, gaps there would leave the
        velocity undetermined, and later rounds keep the turning points of the first.
        """
        order, w0 = self.segment.order, self.segment.decay.frequency
        about_rest = self.signal(w0) - self.segment.decay.rest_position / w0**order
        clock = self.error.of(Clock.of(self.phase(w0), self._with_jumps), w0)
        motion = first_motion(about_rest, clock, sensor_row(order))
        if not self.system.pendulum:
            return w0, motion
        # each half cycle of a large swing takes longer
        turning = MeasuredPath.through(clock.phase, motion.states[:, 0], motion.states[:, 1]).turning_x
        change = float(np.mean([1.0 / frequency_ratio(x, 0) for x in turning])) if turning.size else 1.0
        return w0 * change, motion.at_frequency(change)


def why_not_evaluated(name: str, segment: Segment, scales: Scales) -> str:
    """Why an effect is not evaluated along the motion of a record; empty where it is."""
    effect = EFFECTS[name]
    by_swing = effect.least_swing > 0.0
    if isinstance(effect, ForceEffect) and scales.system.angular:
        by_swing |= math.isfinite(effect.largest_swing)
    if by_swing and not segment.decay.calibrated:
        return "how far it swings is unknown without a calibration of the sensor"
    # lines are searched for, and what is clipped is not evaluated along a motion
    apart = name in (*OF_LINES, SENSOR_CLIPPING.name)
    bent = isinstance(effect, SensorEffect) and not apart and not effect.is_linear(scales)
    return effect.why_not(scales) or ("it is not linear in its size" if bent else "")


def _moving(segment: Segment) -> int:
    """Samples before the last half cycle where the motion stops: the law of a stuck contact is another."""
    if not segment.decay.stops:
        return segment.moving
    half_cycle = math.pi / (segment.decay.frequency * segment.decay.step)
    return max(segment.moving - int(_LEFT_OUT * half_cycle), 2)
