"""Records under one law, each with its own start, sensor effects and random force; perhaps friction.

Each record is analysed alone first, which gives its motion and the sizes of its noise and random force
relative to those of the others. Of one record that is all. Of several, all sets of effects are evaluated on
all records at once: along these motions, to find the common law and the sets that may matter, and those along
the motions smoothed with that law. Where an effect of the law has a shape that the records determine, the
first is repeated with values about the best for all records together, until these stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.spectral_lines import Line
from friction_bayes.estimators.noise.recording_filters import RecordingFilter
from friction_bayes.loop import settings
from friction_bayes.loop.columns.effect_columns import OF_LINES
from friction_bayes.loop.columns.law_columns import LawBefore, LawColumns
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.friction import friction_along
from friction_bayes.loop.data.options import LoopOptions
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.infer.finer_columns import finer_shapes
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion, force_prior
from friction_bayes.loop.infer.record_fit import ForceFit, fit_random_force, force_fit, too_few_turning_points
from friction_bayes.records.quantisation import ROUNDING
from friction_bayes.statespace.force_grid import Posterior, integrate_force
from friction_bayes.statespace.force_prior import GridPoint
from friction_bayes.statespace.problem import Member, Problem, Spread
from friction_bayes.statespace.regression import frequency_change
from friction_bayes.statespace.smoother import SmoothedMotion
from friction_bayes.statespace.subset_evidence import SetEvidences

__all__ = ["LawFit", "fit_law", "spreads_evaluated"]

_SPREADS = 13
_COARSE = 3
"""The rounds before the last take every third of them."""
_HOPELESS = 1e-13
"""Probability of a set in the round before below which the last does without it."""
_MOST_ROUNDS = 8
"""Before the last; shapes may still change after these."""
_SAME_CENTRE = 0.5
"""Change of the middle one of the values of a shape, over their distance, at which these stay the same."""
_SAME_STEP = 0.4
"""The same of the logarithm of that distance."""


def spreads_evaluated() -> Array:
    """Spreads of friction between records that are evaluated, over friction; all are equally probable."""
    least, largest = settings.SETTINGS.spreads
    return np.geomspace(least, largest, _SPREADS)


@dataclass(frozen=True, kw_only=True, eq=False)
class LawFit:
    """Result of the analysis of one or several records.

    Attributes
    ----------
    alone : tuple of ForceFit, length r
        Each record by itself.
    fits : tuple of ForceFit, length r
        Each record under the most probable law and random force.
    posterior : Posterior
        Of the shared coefficients.
    spreads : ndarray, shape (k,)
        Spreads of friction that were evaluated, over ``level``; zero for none.
    level : float
        Friction that these are shares of, natural units.
    """

    alone: tuple[ForceFit, ...]
    fits: tuple[ForceFit, ...]
    posterior: Posterior
    spreads: Array
    level: float

    @classmethod
    def of(cls, fit: ForceFit) -> LawFit:
        """That of one record."""
        return cls(
            alone=(fit,),
            fits=(fit,),
            posterior=fit.posterior,
            spreads=np.zeros(1),
            level=0.0,
        )

    @property
    def problem(self) -> Problem:
        """What the posterior is of."""
        return self.posterior.problem

    @property
    def one(self) -> bool:
        """Whether it is of one record."""
        return len(self.alone) == 1

    @property
    def law(self) -> LawColumns:
        """Columns of the first record: those of the others have the same effects."""
        return self.fits[0].law

    @property
    def sets(self) -> tuple[frozenset[str], ...]:
        """Effects of each set of columns that was evaluated."""
        return self.fits[0].sets

    @property
    def impossible(self) -> Mask:
        """Sets beyond what their priors allow, shape (m,); of several records none is sought."""
        return self.alone[0].impossible if self.one else np.zeros(len(self.sets), np.bool_)

    @property
    def spread_of(self) -> Array:
        """Spread of each of the posterior's sets, shape (n,)."""
        return self.spreads[self.problem.spread_number]

    @property
    def worth_it(self) -> Mask:
        """Sets of the records that can be probable along motions near these, shape (m,)."""
        worth = np.zeros(len(self.sets), np.bool_)
        worth[self.problem.number[self.posterior.weight.max(axis=0) > _HOPELESS]] = True
        return worth

    @property
    def weight(self) -> Array:
        """Posterior of points and sets of the records, over all spreads, shape (g, m)."""
        sets = len(self.sets)
        return np.array([np.bincount(self.problem.number, point, sets) for point in self.posterior.weight])

    def among(self, cells: Mask) -> LawFit:
        """The same given that the truth is at some of the points and sets, ``cells`` of shape (g, m)."""
        posterior = self.posterior.among(cells[:, self.problem.number])
        fits = tuple(fit.under(*each) for fit, each in zip(self.fits, _under(posterior), strict=True))
        return replace(self, posterior=posterior, fits=fits)


def fit_law(
    segments: Sequence[Segment],
    system: Oscillator,
    options: LoopOptions,
    progress: Callable[[str], None] | None = None,
) -> LawFit:
    """The analysis of one or several records of one quantity, the name of each told to ``progress``.

    Where friction is not known to vary, that it does is as probable as a slight effect.

    Raises
    ------
    InputError
        If a record has too few turning points.
    """
    fits = []
    for segment in segments:
        if progress is not None:
            progress(segment.decay.name)
        fit = fit_random_force(segment, system, options.allowed, noise=options.noise)
        if fit is None:
            raise too_few_turning_points(segment)
        fits.append(fit)
    return LawFit.of(fits[0]) if len(fits) == 1 else _together(tuple(fits), system, options)


def _together(alone: tuple[ForceFit, ...], system: Oscillator, options: LoopOptions) -> LawFit:
    """The analysis of several records from that of each: in two rounds, more where shapes are refined."""
    records, varying = _records(alone, system, options.allowed), options.varying_friction
    corrections = [frequency_change(fit.coefficients[fit.regression.stiffness]) for fit in alone]
    w0 = float(np.median([fit.w0 * change for fit, change in zip(alone, corrections, strict=True)]))
    motions = [fit.motion.at_frequency(w0 / fit.w0) for fit in alone]
    along = _along(alone, records, motions, w0)
    spreads = spreads_evaluated()
    near = None
    for _ in range(_MOST_ROUNDS):
        first = _evaluated(alone, along, spreads[::_COARSE], varying=varying, only_mode=True, near=near)
        near = first.posterior.best_force
        one = first.fits[0]
        change = frequency_change(one.coefficients[one.regression.stiffness])
        motions = [fit.motion.at_frequency(change) for fit in first.fits]
        about = [fit.law.before(fit.coefficients, fit.fluctuation) for fit in first.fits]
        w0 *= change
        before, laws = records[0].scores, [fit.coefficients for fit in first.fits]
        scores = finer_shapes(first.fits, laws, [fit.posterior.best for fit in first.fits])
        records = tuple(replace(record, scores=scores) for record in records)
        along = _along(alone, records, motions, w0, about)
        if _alike(before, scores):
            return _evaluated(alone, along, spreads, varying=varying, kept=first.worth_it)
    # in what shapes the effects are hopeless was seen at other values alone
    probable = {first.sets[i] for i in np.flatnonzero(first.worth_it)}
    kept = np.array([effects in probable for effects in along[0].sets])
    return _evaluated(alone, along, spreads, varying=varying, kept=kept)


def _alike(before: dict[str, tuple[float, ...]], after: dict[str, tuple[float, ...]]) -> bool:
    """Whether shapes are taken at nearly the same values: about one, and as far apart."""
    if before.keys() != after.keys():
        return False
    for name, scores in after.items():
        earlier, step = before[name], scores[1] - scores[0]
        if abs(scores[2] - earlier[2]) > _SAME_CENTRE * step:
            return False
        if abs(math.log((earlier[1] - earlier[0]) / step)) > _SAME_STEP:
            return False
    return True


def _records(
    alone: Sequence[ForceFit], system: Oscillator, allowed: Sequence[str]
) -> tuple[MovingRecord, ...]:
    """The records with noise, filter and knocks as each has them alone, and sensor effects of one size.

    Where the sensor has shaped the corners of one, it has those of all: as many harmonics describe them where
    they are sampled alike.
    """
    scales = scales_of([fit.segment for fit in alone], system)
    sizes, filters = _shared_sizes(alone), _filters(alone)
    alike = bool(np.ptp([fit.segment.decay.step for fit in alone]) <= ROUNDING * alone[0].segment.decay.step)
    corners = alike and any(fit.record.free_corners for fit in alone)
    members = []
    for fit, filter_ in zip(alone, filters, strict=True):
        noise, samples = fit.record.noise, fit.record.samples
        record = MovingRecord.of(fit.segment, system, allowed, scales, noise=noise, samples=samples)
        variance = fit.clock.variance
        if filter_ is None:
            # what jumps is known behind a filter alone
            variance = np.where(np.isinf(record.variance), np.inf, variance)
        members.append(
            replace(
                record,
                variance=variance,
                forced=fit.forced,
                error=fit.record.error,
                sizes=sizes,
                filter=filter_,
                free_corners=corners,
                jump=fit.clock.jumps,
            )
        )
    return tuple(members)


def _along(
    alone: Sequence[ForceFit],
    records: Sequence[MovingRecord],
    motions: Sequence[SmoothedMotion],
    w0: float,
    about: Sequence[LawBefore | None] | None = None,
) -> tuple[LawAlongMotion, ...]:
    """The law along motions in natural units of ``w0``."""
    laws = [None] * len(records) if about is None else about
    friction = _friction_of_loss(alone)
    found = []
    for record, motion, lines, law in zip(records, motions, _lines(alone), laws, strict=True):
        along = LawAlongMotion.of(record, motion, w0, lines, friction=friction, about=law)
        if along is None:
            raise too_few_turning_points(record.segment)
        found.append(along)
    return tuple(found)


def _evaluated(
    alone: tuple[ForceFit, ...],
    along: tuple[LawAlongMotion, ...],
    some: Array,
    *,
    varying: bool,
    kept: Mask | None = None,
    only_mode: bool = False,
    near: GridPoint | None = None,
) -> LawFit:
    """Analysis of the sets ``kept`` with ``some`` spreads, and without one unless friction varies."""
    friction = _friction_of_loss(alone)
    law, regression = along[0].law, along[0].regression
    scale = regression.scale[law.dry_friction]
    # a set has at most one column of friction
    rubbing = regression.sets[:, law.frictions]
    columns = np.where(rubbing.any(axis=1), np.array(law.frictions)[rubbing.argmax(axis=1)], -1)
    level = float(np.median([fit.coefficients[fit.law.frictions].sum() for fit in alone])) or friction
    spreads = some if varying else np.append(0.0, some)
    share = np.full(spreads.size, (1.0 if varying else settings.SETTINGS.nuisance) / some.size)
    share[spreads == 0.0] = 1.0 - settings.SETTINGS.nuisance
    problem = Problem(
        _members(alone, along),
        np.array([column.own for column in law.columns]),
        Spread(columns=columns, sd=spreads * level / scale, log_prior=np.log(share)),
        kept,
    )
    prior = force_prior(friction)
    if not all(fit.forced for fit in alone):
        prior = prior.without_force
    posterior = integrate_force(problem, prior, near=near, only_mode=only_mode)
    fits = tuple(
        force_fit(found, *each, one.sensor_noise)
        for found, each, one in zip(along, _under(posterior), alone, strict=True)
    )
    return LawFit(
        alone=alone,
        fits=fits,
        posterior=posterior,
        spreads=spreads,
        level=level,
    )


def _shared_sizes(alone: Sequence[ForceFit]) -> dict[str, float]:
    """Median size of each sensor effect over the records that have it."""
    own = [fit.law.sensor_sizes(fit.coefficients) for fit in alone]
    found = {effect for sizes in own for effect in sizes}
    return {effect: float(np.median([sizes[effect] for sizes in own if effect in sizes])) for effect in found}


def _filters(alone: Sequence[ForceFit]) -> Sequence[RecordingFilter | None]:
    """The filter of each record; none where one has none, as the records of one sensor are.

    With doubts of no size where another record's has more columns.
    """
    filters = [fit.law.filter for fit in alone if fit.law.filter is not None]
    if len(filters) < len(alone):
        return [None] * len(alone)
    columns = [each.unseen(1).shape[1] + len(each.doubts) for each in filters]
    lacking = [max(columns) - own for own in columns]
    return [
        replace(f, doubts=(*f.doubts, *[np.zeros_like] * k)) for f, k in zip(filters, lacking, strict=True)
    ]


def _friction_of_loss(records: Sequence[ForceFit | LawAlongMotion]) -> float:
    """Friction that alone would explain the loss of amplitude of the median record, natural units."""
    return float(np.median([friction_along(record.path) for record in records]))


def _lines(alone: Sequence[ForceFit]) -> list[tuple[Line, ...]]:
    """The strongest line of each effect in each record; one that has none is tried at another's."""
    lines: list[tuple[Line, ...]] = [()] * len(alone)
    for effect in OF_LINES:
        own = [[line for line in fit.lines if line.effect == effect][:1] for fit in alone]
        other = next((strongest for strongest in own if strongest), [])
        lines = [(*before, *(strongest or other)) for before, strongest in zip(lines, own, strict=True)]
    return lines


def _members(alone: Sequence[ForceFit], along: Sequence[LawAlongMotion]) -> list[Member]:
    """The records with their sizes of noise and force relative to each other, from each record alone."""
    noises = np.array([math.log(fit.posterior.noise_sd) for fit in alone])
    # all are equal where no random force may act
    forces = np.array([math.log(fit.posterior.force_sd.median()) if fit.forced else 0.0 for fit in alone])
    noises, forces = np.exp(noises - noises.mean()), np.exp(forces - forces.mean())
    return [
        Member(regression=found.regression, noise=float(noise), force=float(force))
        for found, noise, force in zip(along, noises, forces, strict=True)
    ]


def _under(posterior: Posterior) -> Iterator[tuple[Posterior, Array]]:
    """Posterior and coefficients of each record in the most probable set at the most probable point.

    The coefficients of one record are its own posterior's. Of several, the others determine them too: each
    has that set at that point alone.
    """
    problem, best = posterior.problem, posterior.best
    row = best.row
    given = problem.conditional(best, row)
    laws = given.laws(posterior.best_law()[given.columns][None])[0]
    for member, law in zip(problem.members, laws, strict=True):
        if len(laws) == 1:
            yield posterior, law
            continue
        own = Problem.of(member.regression)
        log_weight = np.full(len(own.sets), -np.inf)
        log_weight[problem.number[row]] = 0.0
        noise2 = np.full(len(own.sets), float(best.found.noise2[row]) * member.noise**2)
        found = SetEvidences(log_weight, noise2, best.found.full_noise2 * member.noise**2)
        point = GridPoint(ratio=member.ratio(best.ratio), tau=best.tau, log_volume=0.0, found=found)
        yield Posterior(own, [point]), law
