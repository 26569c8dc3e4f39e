"""A round in which the law of one record converges, and those that may follow it.

In each, the motion is smoothed with the law of the round before, in units of the frequency found there, and
the effects are evaluated along it, until neither the law nor the sensor effects change: one that jumps where
the motion turns, such as a lag, is in the first motion, and moves its turning points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.decay.spectral_lines import Line
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.noise.filter_evidence import filters_along
from friction_bayes.estimators.noise.high_passes import MotionBehind, likely_high_passes
from friction_bayes.estimators.noise.noise_level import noise_floor, sensor_noise
from friction_bayes.estimators.noise.recording_filters import RecordingFilter, blended
from friction_bayes.loop.columns.law_columns import SENSOR_ZERO, LawBefore
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.friction import friction_along
from friction_bayes.loop.infer.finer_columns import finer_shapes, lines_in_residual, lines_kept
from friction_bayes.loop.infer.impossible import integrate_possible
from friction_bayes.loop.infer.knocks import log_odds_of_knocks, next_knock
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.loop.noise.correlated_noise import (
    NO_ERROR,
    Colour,
    SensorError,
    colour_of,
    find_sensor_error,
)
from friction_bayes.loop.noise.likelihood import come_anywhere
from friction_bayes.mechanics.effects.outliers import OUTLIERS
from friction_bayes.statespace.coloured_noise import with_missing_drawn
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.regression import frequency_change
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["Round"]

_AUDIBLE = 1.01
"""Noise over the least possible above which it is noise, not rounding."""
_SETTLED = 2e-3
"""Correction of the stiffness above which the effects are evaluated once more."""
_MOVED = 0.2
"""Share of the noise by which sensor effects may change at a sample from round to round."""


@dataclass(frozen=True, eq=False)
class Round:
    """A law along the motion of the round before.

    Attributes
    ----------
    whole : MovingRecord
        With the samples that are set aside here.
    ceiling, outliers : ndarray of bool, shape (n,)
        Samples that are set aside: near an end of the sensor's range, and outliers.
    other_lines : bool
        Whether one of the lines that may be there is new, or one has gone.
    found : LawAlongMotion
    near : GridPoint or None
        The most probable random force of the round before; None in the first.
    motion_without_force : bool
        Whether the next round goes along the motion of the best law without a random force, however probable
        one is. What neighbouring samples share of the noise then stays as it is: that may be the force.
    """

    whole: MovingRecord
    ceiling: Mask
    outliers: Mask
    other_lines: bool
    found: LawAlongMotion
    near: GridPoint | None
    motion_without_force: bool = False

    @classmethod
    def starting(
        cls, whole: MovingRecord, w0: float, motion: SmoothedMotion, about: LawBefore | None = None
    ) -> Round | None:
        """Along a motion in units of ``w0`` [rad/s], that of a law ``about`` which others are linear, if any.

        None where it holds too few turning points.
        """
        none = np.zeros(whole.samples, np.bool_)
        whole, found = _law_along(whole, none, motion, w0, (), about)
        if found is None:
            return None
        ceiling = whole.segment.sides[: whole.samples] != 0.0
        return cls(whole, ceiling, none, False, found, None, motion_without_force=True)

    @cached_property
    def with_force(self) -> Round:
        """The same where a random force may go with the motion from now on."""
        return replace(self, motion_without_force=False)

    @property
    def aside(self) -> Mask:
        """Samples that are set aside, shape (n,)."""
        return self.ceiling | self.outliers

    @cached_property
    def _posterior(self) -> Posterior:
        """At its mode, given that its best set is possible."""
        prior = self.found.prior.without_force if self.motion_without_force else self.found.prior
        return integrate_possible(self.found, prior, self.near)

    @property
    def log_evidence(self) -> float:
        """Of the record, in units of the signal; about a law's own motion without a random force alone.

        Next to an exact motion the contribution of a force counts as zero.
        """
        used = int(self.found.clock.used.sum())
        found = self._posterior.log_evidence + self.whole.error.log_volume
        if self.whole.filter is not None:
            found += self.whole.filter.log_prior
        found += log_odds_of_knocks(self.found.clock.jumps)
        if self.motion_without_force:
            found += math.log(self.found.prior.none)
        return found - used * self.whole.segment.order * math.log(self.found.w0)

    @property
    def _best(self) -> GridPoint:
        """The point with the law that the next round goes along."""
        return self._posterior.best

    @cached_property
    def _law(self) -> Array:
        return self._posterior.best_law()

    @property
    def is_shaped(self) -> bool:
        """Whether noise is coloured, or corners may be of another shape than the motion gives them."""
        whole = self.whole
        return isinstance(whole.error, Colour) or whole.filter is not None or whole.free_corners

    @cached_property
    def leaves_nothing(self) -> bool:
        """Whether the residual of the law is white noise, without a knock or a probable random force."""
        regression = self.found.regression
        if self._best.ratio > 0.0 or regression.clock.jumps.any():
            return False
        return whiteness(regression.innovations(self._law, 0.0, self._best.tau)[regression.clock.used]).white

    @property
    def is_dry_friction_alone(self) -> bool:
        """Whether dry friction and an error of the sensor's zero alone leave white noise."""
        return self.leaves_nothing and self.acting <= SENSOR_ZERO

    @property
    def acting(self) -> frozenset[str]:
        """Effects of its most probable law."""
        return self.found.sets[self._best.row]

    def following(self) -> Round | None:
        """The next; None where its motion holds too few turning points or samples that are fitted."""
        found, law, best = self.found, self._law, self._best
        regression, segment, whole = found.regression, self.whole.segment, self.whole
        white = regression.innovations(law, best.ratio, best.tau) / best.noise
        smoothed = regression.smoothed(law, best)
        more = lines_in_residual(white, smoothed.states[:, 2], segment, found.lines, whole.effects)
        kept = lines_kept(found, law, best)
        error = self._next_error
        if error is not None:
            whole = replace(whole, error=error)
        whole = replace(
            whole,
            sizes=whole.sizes | found.law.sensor_sizes(law),
            scores=finer_shapes([found], [law], [best]),
        )
        ceiling, outliers = self._set_aside(smoothed)
        change = frequency_change(law[regression.stiffness])
        motion = smoothed.at_frequency(change)
        about = found.law.before(law, motion.states[:, 2])
        whole, along = _law_along(whole, ceiling | outliers, motion, found.w0 * change, (*kept, *more), about)
        if along is None or not along.determined:
            return None
        other_lines = bool(more) or len(kept) < len(found.lines)
        return replace(
            self,
            whole=whole,
            ceiling=ceiling,
            outliers=outliers,
            other_lines=other_lines,
            found=along,
            near=self._posterior.best_force,
        )

    def half_as_far(self, before: Round) -> Round | None:
        """The same law along the motion midway from that of the round before; None where it does not turn.

        What it is linear about, law and random force, stays that of the whole step.
        """
        mine, its = self.found, before.found
        motion = its.regression.motion.at_frequency(mine.w0 / its.w0).midway(mine.regression.motion)
        return self._again(self.whole, motion=motion)

    @property
    def _next_error(self) -> SensorError | Colour | None:
        """The noise that neighbouring samples share; None where it is unchanged."""
        if isinstance(self.whole.error, Colour):
            return self._colour_near_motion if self.whole.error.least_noise else self._colour
        if self.whole.noise == "white" or self.motion_without_force:
            return None
        return find_sensor_error(self.found.regression, self._posterior, self.found.prior, self.found.w0)

    @cached_property
    def left(self) -> Array:
        """Residual of the law, natural units; on a grid, what is not used is like the rest of it."""
        clock, residual, known = self.found.clock, self.found.regression.residual(self._law), self.whole.known
        return with_missing_drawn(residual[known], clock.used[known]) if clock.even else residual[clock.used]

    @property
    def _colour(self) -> Colour | None:
        """Colour of the residual; None where that is white."""
        return colour_of(self.left, int(np.count_nonzero(self._law)))

    @property
    def _colour_near_motion(self) -> Colour:
        """The same of noise that is nowhere below its level near the motion's frequency."""
        clock, fitted = self.found.clock, int(np.count_nonzero(self._law))
        phase = clock.phase[self.whole.known if clock.even else clock.used]
        floor = noise_floor(self.left, phase, self.whole.segment.order, fitted, self.whole.filter)
        noise = sensor_noise(self.left, phase, fitted, floor, even=clock.even)
        return Colour(noise.colour, noise.coloured_floor)

    def among(self, allowed: tuple[str, ...]) -> Round | None:
        """The same where these effects may act."""
        return self._again(replace(self.whole, allowed=allowed))

    def with_lines(self, lines: tuple[Line, ...]) -> Round | None:
        """The same where these lines may be there."""
        return self._again(self.whole, lines=lines)

    def without(self, samples: Mask) -> Round:
        """The same without some samples, shape (n,)."""
        if not self.found.clock.used[samples].any():
            return self
        found = self.found.on(self.found.record.setting_aside(samples))
        return replace(self, whole=self.whole.setting_aside(samples), found=found)

    def in_its_colour(self) -> Round | None:
        """The same under noise of the colour of its law's residual, whatever explains that.

        None where that is white, or the sensor's rounding.
        """
        regression = self.found.regression
        audible = self._best.noise > _AUDIBLE * regression.least_noise
        colour = self._colour if audible and regression.clock.even else None
        return None if colour is None else self._under(colour)

    def _under(self, error: Colour) -> Round | None:
        """The same round with noise of a colour."""
        return self._again(replace(self.whole, error=error, jump=None), near=None)

    def with_free_corners(self) -> Round | None:
        """The same where the sensor may have given corners any shape; None for one that shows displacement.

        Dry friction makes next to no corners in a displacement.
        """
        if self.whole.segment.order == 0:
            return None
        return self._again(replace(self.whole, free_corners=True), near=None, motion_without_force=False)

    def behind_filters(self, *, high_passes: bool) -> list[Round]:
        """The same law behind each filter that the record may have gone through: high passes, or one other.

        None where there is none.
        """
        segment, n = self.whole.segment, self.whole.samples
        bare = self._again(replace(self.whole, filter=None))
        if bare is None or not bare.found.clock.even:
            return []
        missing = (self.aside | segment.ignored[:n]) & ~segment.near_jumps[:n]
        signal = np.where(missing, np.nan, bare.found.regression.target + bare.found.law.known)
        if high_passes:
            # those of the filter come last
            seen = self.whole.filter
            acting = None if seen is None else self._law[: len(bare.found.law.columns)] != 0.0
            filters = _high_passes_of(bare.found, signal, acting, in_time=seen is not None and seen.in_time)
        else:
            filters = _filters_of(bare.found, signal)
        behind = [replace(self.whole.behind(each), error=NO_ERROR) for each in filters]
        found = [self._again(each, near=None, motion_without_force=True) for each in behind]
        return [each for each in found if each is not None]

    def _again(
        self,
        whole: MovingRecord,
        *,
        motion: SmoothedMotion | None = None,
        lines: tuple[Line, ...] | None = None,
        **changed: Any,
    ) -> Round | None:
        """Its law under other circumstances, along its motion or another, with its lines or others.

        None where it does not turn; what else of the round is ``changed`` is given by field.
        """
        found = self.found
        motion = found.regression.motion if motion is None else motion
        lines = found.lines if lines is None else lines
        whole, along = _law_along(whole, self.aside, motion, found.w0, lines, found.law.about)
        return None if along is None else replace(self, whole=whole, found=along, **changed)

    def in_its_colour_near_motion(self) -> Round | None:
        """The same, the noise nowhere below its level near the motion's frequency."""
        return self._under(self._colour_near_motion)

    def _set_aside(self, smoothed: SmoothedMotion) -> tuple[Mask, Mask]:
        """Samples near an end of the range, and outliers, shape (n,) both."""
        left = self.found.left_out(self._law, self._best)
        ceiling, shown = self.ceiling, np.isfinite(self.whole.variance) & ~self.ceiling
        white = not isinstance(self.whole.error, Colour)
        # one outlier spoils as many innovations of coloured noise as that has coefficients
        may_be = white and OUTLIERS.name in self.whole.allowed
        noise = left.noise(outliers=may_be and left.heavy_tails(shown))
        if ceiling.any():
            ceiling = left.near_ceiling(noise)
            shown = shown & ~ceiling
        outliers = noise.outliers & shown
        return ceiling, outliers & come_anywhere(outliers, shown, smoothed)

    def stays(self, after: Round) -> bool:
        """Whether the round that follows agrees with this one."""
        other_noise = not self.whole.error.alike(after.whole.error)
        other_noise |= not np.array_equal(after.aside, self.aside)
        # of fewer samples not all effects are evaluated
        if after.other_lines or other_noise or after.whole.allowed != self.whole.allowed:
            return False
        change = after.found.w0 / self.found.w0 - 1.0
        sizes = self._law[self.found.of_sensor]
        moved = np.max(np.abs(after.found.sensor_errors(sizes) - self.found.sensor_errors(sizes)))
        straight = self.found.path.serves(after.found.path.x, after.found.prior.centre)
        moved = max(moved, np.max(np.abs(after.found.path.x - self.found.path.x)))
        return straight and abs(change) < _SETTLED and bool(moved < _MOVED * self._best.noise)

    def next_knock(self) -> Array | None:
        """How far the force may jump in each interval, see :func:`.knocks.next_knock`."""
        friction = friction_along(self.found.path)
        return next_knock(self.found.regression, self._posterior.best_law(), self._posterior.best, friction)

    def jumping(self, jump: Array) -> Round:
        """The same with a force that may jump, shape (n - 1,)."""
        found = self.found.on(replace(self.found.record, jump=jump))
        return replace(self, whole=replace(self.whole, jump=jump), found=found, motion_without_force=False)


def _law_along(
    whole: MovingRecord,
    aside: Mask,
    motion: SmoothedMotion,
    w0: float,
    lines: Sequence[Line],
    about: LawBefore | None,
) -> tuple[MovingRecord, LawAlongMotion | None]:
    """A record and its law along a motion without the samples ``aside``.

    Fewer samples than columns do not determine the shapes that effects may take: then the effects of one
    column alone are evaluated.
    """
    along = LawAlongMotion.of(whole.setting_aside(aside), motion, w0, lines, about=about)
    if along is None or along.determined:
        return whole, along
    whole = whole.of_one_column(along.law.columns)
    return whole, LawAlongMotion.of(whole.setting_aside(aside), motion, w0, lines, about=about)


def _filters_of(found: LawAlongMotion, signal: Array) -> list[RecordingFilter]:
    """The mean of a record's probable filters, with their differences; none where there is rather none.

    As :func:`friction_bayes.estimate` finds them (:mod:`friction_bayes.estimators.noise.filter_evidence`),
    along the motion of a law ``found`` as if there were no filter. Forces other than friction are represented
    by a swing of varying amplitude and phase: above its frequency they are small next to the corners.
    """
    law, path = found.law, found.path
    plain = np.column_stack([law.sensor[:, [*law.always, law.dry_friction]], np.ones(path.phase.size)])
    filters = filters_along(path, found.segment.order, signal, law.known, plain, len(law.always))
    likely = filters.likely if filters.probability > 0.5 else []
    return [blended(likely, law.read.values)] if likely else []


def _high_passes_of(
    found: LawAlongMotion, signal: Array, acting: Mask | None, *, in_time: bool
) -> list[RecordingFilter]:
    """The same of high passes (:mod:`friction_bayes.estimators.noise.high_passes`), one for each order.

    They differ in what they remember, which a swing that varies may hide: where the columns of the law behind
    one are known, the ``acting`` ones, shape (p,), take its place.
    """
    law, always = found.law, None
    columns = law.sensor[:, [*law.always, law.dry_friction]]
    if acting is not None:
        columns, always = law.sensor[:, acting & law.moved], law.sensor[:, acting & ~law.moved].T
    behind = MotionBehind(signal, law.known, columns, found.path.angle, always, in_time=in_time)
    orders: dict[int, list[tuple[float, RecordingFilter]]] = {}
    for each in likely_high_passes(behind, found.segment.order):
        orders.setdefault(each[1].remembered, []).append(each)
    return [blended(each, law.read.values) for each in orders.values()]
