"""A record while it moves, and its law along a motion: data and columns of one round of an analysis."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, margin
from friction_bayes.loop import settings
from friction_bayes.loop.columns.column_sets import ColumnSets, column_sets
from friction_bayes.loop.columns.law_before import LawBefore
from friction_bayes.loop.columns.law_columns import Circumstances, LawColumns, law_columns
from friction_bayes.loop.columns.lines import OF_LINES, Line
from friction_bayes.loop.data.friction import friction_along
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.colour import Colour
from friction_bayes.loop.noise.correlated_error import NO_ERROR, SensorError
from friction_bayes.mechanics.effects import (
    EFFECTS,
    Effect,
    ForceEffect,
    Scales,
    SensorEffect,
    in_catalogue_order,
)
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING
from friction_bayes.mechanics.pendulum import frequency_ratio
from friction_bayes.statespace.force_prior import ForcePrior
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.response import Feedback, feedback_steps
from friction_bayes.statespace.smoother import MOTION_KNOWN_TO, SmoothedMotion, first_motion

__all__ = [
    "LEAST_TURNS",
    "LawAlongMotion",
    "MovingRecord",
    "along_motion",
    "force_prior",
    "why_not_evaluated",
]


LEAST_TURNS = 2
"""Least number of turning points, between which a law has a whole half cycle."""
_LEFT_OUT = 1.5
"""Half cycles before a motion stops that are left out: it ends between two turning points then, neither of
which is in doubt."""


def along_motion(effect: Effect, scales: Scales) -> bool:
    """Whether an effect can be evaluated along a measured motion: forces, lines and linear sensor effects."""
    if isinstance(effect, ForceEffect) or effect.name in OF_LINES:
        return True
    return isinstance(effect, SensorEffect) and effect.is_linear(scales)


@dataclass(frozen=True, eq=False)
class LawAlongMotion:
    """A law along a motion.

    Attributes
    ----------
    w0 : float
        Frequency of the natural units [rad/s].
    path : MeasuredPath
    law : LawColumns
    sets : ColumnSets
    regression : LawRegression
    prior : ForcePrior
    """

    w0: float
    path: MeasuredPath
    law: LawColumns
    sets: ColumnSets
    regression: LawRegression
    prior: ForcePrior

    @cached_property
    def problem(self) -> Problem:
        """The regression of this record alone."""
        return Problem.of(self.regression)

    def without(self, sets: Mask) -> LawAlongMotion:
        """The same without the sets, ``sets`` of shape (m,), which have no prior probability then."""
        log_prior = np.where(sets, -np.inf, self.regression.log_prior)
        return replace(self, regression=replace(self.regression, log_prior=log_prior))

    @property
    def determined(self) -> bool:
        """Whether more samples are fitted than there are columns."""
        return int(np.count_nonzero(np.isfinite(self.regression.clock.variance))) > self.law.scale.size

    @property
    def of_sensor(self) -> Mask:
        """Columns of sensor effects, shape (p,)."""
        return np.array([isinstance(EFFECTS.get(c.effect), SensorEffect) for c in self.law.columns])

    def sensor_errors(self, sizes: Array) -> Array:
        """Errors of the samples by sensor effects of some sizes, natural units, shape (n,).

        They follow the motion: one that jumps where the motion turns moves with the turning points.
        """
        return np.asarray(self.law.sensor[:, self.of_sensor] @ sizes)


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
        variance = np.where(segment.free[:n], 1.0, np.inf)
        names = in_catalogue_order(allowed)
        return cls(segment, n, system, names, scales, variance, noise, RANDOM_FORCE.name in allowed)

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Those of the law: what can be evaluated along a motion."""
        return tuple(
            name
            for name in self.allowed
            if along_motion(EFFECTS[name], self.scales)
            and not why_not_evaluated(name, self.segment, self.scales)
        )

    def setting_aside(self, samples: Mask) -> MovingRecord:
        """The same without some more samples, shape (n,)."""
        return replace(self, variance=np.where(samples, np.inf, self.variance))

    def behind(self, filter_: RecordingFilter) -> MovingRecord:
        """The same behind a filter, without the samples at either end, where its response is unknown.

        The force may no longer jump.
        """
        left_out = margin(filter_.angle)
        variance = np.full(self.samples, np.inf)
        inside = slice(left_out, self.samples - left_out)
        variance[inside] = np.where(self.segment.ignored[: self.samples], 1.0, self.variance)[inside]
        return replace(self, variance=variance, filter=filter_, forced=False, jump=None)

    def of_one_column(self, law: LawColumns) -> MovingRecord:
        """The same without effects that have several columns in a law, or none."""
        columns = Counter(column.effect for column in law.columns)
        left_out = {name for name in self.effects if columns[name] != 1}
        return replace(self, allowed=tuple(name for name in self.allowed if name not in left_out))

    def signal(self, w0: float) -> Array:
        """The samples in natural units of a frequency, shape (n,)."""
        return self.segment.values[: self.samples] / w0**self.segment.order

    @property
    def _least_noise(self) -> float:
        """Of the sensor's rounding, and at least what the interpolated motion is known to, its unit."""
        return max(self.segment.least_noise, MOTION_KNOWN_TO * self.scales.signal)

    def phase(self, w0: float) -> Array:
        """Their time stamps in natural units of a frequency, shape (n,)."""
        time = self.segment.time[: self.samples]
        return np.asarray(w0 * (time - time[0]))

    def clock_along(self, path: MeasuredPath, feedback: Feedback, w0: float) -> Clock:
        """Their time stamps and noise, and the propagation of a perturbation by oscillator and law."""
        steps = feedback_steps(path, feedback) if self.forced else None
        return self.error.of(Clock.of(path.phase, self.variance, path.stiffness, self.jump, steps), w0)

    def first_motion(self) -> tuple[float, SmoothedMotion]:
        """The frequency of small swings [rad/s] and the motion, in its units, before any law is known.

        With the values next to the jumps of an acceleration: without a law, gaps there would leave the
        velocity undetermined, and later rounds keep the turning points of the first.
        """
        order, w0 = self.segment.order, self.segment.decay.frequency
        about_rest = self.signal(w0) - self.segment.decay.rest_position / w0**order
        variance = np.where(self.segment.ignored[: self.samples], 1.0, self.variance)
        clock = self.error.of(Clock.of(self.phase(w0), variance), w0)
        motion = first_motion(about_rest, clock, sensor_row(order))
        if not self.system.pendulum:
            return w0, motion
        # each half cycle of a large swing takes longer
        turning = MeasuredPath.through(clock.phase, motion.states[:, 0], motion.states[:, 1]).turning_x
        change = float(np.mean([1.0 / frequency_ratio(x, 0) for x in turning])) if turning.size else 1.0
        return w0 * change, motion.at_frequency(change)

    def along(
        self,
        motion: SmoothedMotion,
        w0: float,
        lines: Sequence[Line],
        *,
        friction: float | None = None,
        about: LawBefore | None = None,
    ) -> LawAlongMotion | None:
        """The law along a motion; None where that holds too few turning points.

        Parameters
        ----------
        motion : SmoothedMotion
        w0 : float
            Frequency of the natural units [rad/s].
        lines : sequence of Line
            Those of each effect, the strongest first.
        friction : float, optional
            Rough friction, natural units; what explains the loss of amplitude by default.
        about : LawBefore, optional
            The law about which the columns are linear; forces along the motion alone by default.
        """
        order = self.segment.order
        x, v = motion.states[:, :2].T.copy()
        path = MeasuredPath.through(self.phase(w0), x, v, motion.velocity_sd, pendulum=self.system.pendulum)
        if path.turning.size < LEAST_TURNS:
            return None
        rough = friction_along(path) if friction is None else friction
        given = Circumstances(
            system=self.system,
            scales=self.scales,
            effects=self.effects,
            order=order,
            duration=self.segment.duration,
            sizes=self.sizes,
            scores=self.scores,
            block=self.segment.block,
            filter=self.filter,
        )
        law = law_columns(path, given, w0=w0, friction=rough, lines=lines, about=about)
        clock = self.clock_along(path, law.feedback, w0)
        sets = column_sets(law, self.effects)
        regression = LawRegression(
            clock=clock,
            row=law.row,
            names=tuple(str(j) for j in range(law.scale.size)),
            columns=law.sensor,
            states=law.states,
            known_states=law.known_states,
            target=self.signal(w0) - law.known,
            scale=law.scale,
            positive=law.positive,
            sets=sets.columns,
            log_prior=sets.log_prior,
            stiffness=law.always[2],
            motion=motion,
            least_noise=max(self._least_noise / w0**order, self.error.least_noise),
        )
        prior = force_prior(rough)
        # a random force with coloured noise would count twice: both explain what is not white
        may_act = self.forced and clock.autoregression is None
        return LawAlongMotion(w0, path, law, sets, regression, prior if may_act else prior.without_force)


def force_prior(friction: float) -> ForcePrior:
    """Prior of the random force, given a rough friction, natural units."""
    return ForcePrior(centre=settings.SETTINGS.force_share * friction)


def why_not_evaluated(name: str, segment: Segment, scales: Scales) -> str:
    """Why an effect is not evaluated along the motion of a record; empty where it is."""
    effect = EFFECTS[name]
    by_swing = effect.least_swing > 0.0
    if isinstance(effect, ForceEffect) and scales.system.angular:
        by_swing |= math.isfinite(effect.largest_swing)
    if by_swing and segment.decay.unit in UNCALIBRATED_UNITS:
        return "how far it swings is unknown without a calibration of the sensor"
    bent = isinstance(effect, SensorEffect) and not along_motion(effect, scales)
    return effect.why_not(scales) or (
        "it is not linear in its size" if bent and name != SENSOR_CLIPPING.name else ""
    )


def _moving(segment: Segment) -> int:
    """Samples before the last half cycle where the motion stops: the law of a stuck contact is another."""
    if not segment.decay.stops:
        return segment.moving
    half_cycle = math.pi / (segment.decay.frequency * segment.decay.step)
    return max(segment.moving - int(_LEFT_OUT * half_cycle), 2)
