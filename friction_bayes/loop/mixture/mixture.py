r"""The posterior over all candidates, friction averaged over them, and how far other priors would shift it.

The analysis evaluates points of a grid over the random force, and sets of columns; one candidate comprises
all of those with the same effects. Every candidate has its evidence on one scale, so that the posterior is
one mixture. Numbers of the record are summaries of that mixture; residuals and parameters, which belong to
one law, are reported for the most probable candidate.

Coefficients of effects are normal, scaled by the set-up. Were all priors :math:`f` times as wide, a draw with
:math:`n` coefficients whose squares add up to :math:`S` variances of the prior would have the weight

.. math:: f^{-n} \exp\left(-\tfrac12 S (f^{-2} - 1)\right)

(importance weights, Kallioinen et al., Stat. Comput. 34, 2024). With another number of effects
expected, the weight of a draw is the ratio of the prior probabilities of its set among the effects evaluated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy import special

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.core.summary import TAILS
from friction_bayes.loop import settings
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.slight_effects import SlightForce
from friction_bayes.mechanics.effects.inclusion import EXPECTED, log_probability
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["CandidateMixture", "Cells", "Names", "cells_of", "prior_sensitivity", "ranked"]

Names = frozenset[str]

_LEAST = 1e-12
"""Least share of the total probability that counts."""
_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""
_FACTORS = (0.1, 10.0)
_EXPECTED = {"inclusion_halved": 0.5 * EXPECTED, "inclusion_doubled": 2.0 * EXPECTED}
_LEAST_DRAWS = 50.0
"""Effective number of draws below which no value is reported."""
_LARGEST_ERROR = 0.1
"""Monte Carlo error of a shift, in standard deviations of friction, above which no value is reported."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Probability of each set of columns at each point of the grid, under each kind of noise, (j, g, m).

    Zero where that is no candidate; the sum need not be one. Points are ``forced`` with a random force; sets
    and kinds of noise are known by their effects.
    """

    weight: Array
    forced: Mask
    effects: Sequence[Names]
    noises: Sequence[Names] = (frozenset(),)

    @property
    def total(self) -> Array:
        """Probability of points and sets, shape (g, m)."""
        return np.asarray(self.weight.sum(axis=0))

    @cached_property
    def _sets(self) -> tuple[list[Names], Integers]:
        """Distinct sets of effects, force and noise included, and the index of each cell's, (j, g, m)."""
        place = {names: i for i, names in enumerate(dict.fromkeys(self.effects))}
        forces = frozenset[str](), frozenset({RANDOM_FORCE.name})
        names = [law | force | noise for noise, force, law in product(self.noises, forces, place)]
        index = np.arange(len(names)).reshape(len(self.noises), 2, len(place))
        which = np.array([place[law] for law in self.effects])
        return names, index[:, self.forced.astype(int)][:, :, which]

    @cached_property
    def probabilities(self) -> dict[Names, float]:
        """Probability of each candidate that counts."""
        names, index = self._sets
        sums = np.bincount(index.ravel(), self.weight.ravel(), len(names))
        return {names[i]: float(sums[i]) for i in np.flatnonzero(sums > _LEAST * sums.sum())}

    def places(self, sets: Sequence[Names]) -> Integers:
        """Index of the candidate that each cell belongs to, shape (j, g, m); -1 without one."""
        place, (names, index) = {each: i for i, each in enumerate(sets)}, self._sets
        return np.array([place.get(each, -1) for each in names])[index]


def _unknowable(fit: ForceFit) -> set[str]:
    """Effects on which the samples have almost no information, start and friction free.

    A constant force in an acceleration record is one: its probability would stay that of its prior.
    """
    always = [*fit.law.always, fit.law.dry_friction]
    gram = fit.regression.whiten_at(0.0, 1.0).gram[:-1, :-1] / fit.posterior.points[0].found.full_noise2
    absorbed = np.linalg.solve(gram[np.ix_(always, always)] + np.eye(len(always)), gram[always])
    left = np.diag(gram) - np.sum(gram[:, always].T * absorbed, axis=0)
    informed = left > settings.SETTINGS.least_information
    names = {column.effect for column in fit.law.columns if column.kind == "effect"}
    return {
        name
        for name in names
        if not any(informed[j] for columns in fit.law.alternatives(name) for j in columns)
    }


def cells_of(fit: LawFit) -> Cells:
    """All sets that the samples can determine and whose friction resists, under each kind of noise.

    Raises
    ------
    InputError
        If there is none.
    """
    nothing = set.intersection(*(_unknowable(one) for one in fit.alone))
    known = np.array([not names & nothing for names in fit.sets]) & ~fit.impossible
    certain = frozenset({SENSOR_CLIPPING.name} if any(one.segment.clipped for one in fit.alone) else ())
    noises = {certain: 1.0}
    for one in fit.alone:
        # what one record's sensor has, the records have
        pairs = list(product(noises.items(), one.sensor_noise.probabilities(len(fit.alone)).items()))
        noises = dict.fromkeys((names | more for (names, _), (more, _) in pairs), 0.0)
        for (names, share), (more, probability) in pairs:
            noises[names | more] += share * probability
    weights = np.array([probability * known * fit.weight for probability in noises.values()])
    if not weights.any():
        raise InputError(
            fit.alone[0].segment.decay.name,
            "no law whose friction resists the motion explains it",
            "look at the record: it may leap, start over, or be driven",
        )
    return Cells(weights, fit.posterior.ratio > 0.0, fit.sets, list(noises))


def ranked(probability: Mapping[Names, float]) -> tuple[tuple[Names, ...], Array]:
    """The candidates that are listed, most probable first, and their probabilities.

    Of numbers in proportion to these; the empty set is listed whatever its own.
    """
    pairs = sorted(probability.items(), key=lambda pair: -pair[1])
    share = np.array([p for _, p in pairs])
    share /= share.sum()
    listed = [c for c, (names, _) in enumerate(pairs) if share[c] > _LEAST_PROBABILITY or not names]
    return tuple(pairs[c][0] for c in listed), share[listed] / share[listed].sum()


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateMixture:
    """The posterior over the candidates, and draws from it, of each in proportion to its probability.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Candidates, most probable first; the empty set is always among them.
    probabilities : ndarray, shape (c,)
    candidate : ndarray of int, shape (k,)
        Which of them each draw has; -1 where that is not listed.
    friction : ndarray, shape (k,)
        Friction force of the declared system [N or N m].
    random_force : ndarray, shape (k,)
        Sd of the random force [N or N m]; zero without one.
    scores : ndarray, shape (k, c)
        Coefficients of effects in units of their prior sd; zero where the draw lacks one.
    """

    sets: tuple[Names, ...]
    probabilities: Array
    candidate: Integers
    friction: Array
    random_force: Array
    scores: Array

    def probability(self, name: str) -> float:
        """Probability that an effect acts."""
        return min(float(self.probabilities[[name in names for names in self.sets]].sum()), 1.0)

    def with_slight_force(self, slight: SlightForce | None, rng: np.random.Generator) -> CandidateMixture:
        """The same with a random force too slight to show, if any, in draws without one."""
        if slight is None:
            return self
        still = self.random_force == 0.0
        return replace(self, friction=np.where(still, slight.added_to(self.friction, rng), self.friction))

    @property
    def agrees(self) -> Mask:
        """Which candidates agree with the friction averaged over all, shape (c,).

        One agrees where its mean lies within the 90 % interval over all, or the mean over all within its own;
        one without draws does not.
        """
        low, high, mean = *np.quantile(self.friction, TAILS), self.friction.mean()
        found = np.zeros(len(self.sets), dtype=bool)
        for c in np.unique(self.candidate[self.candidate >= 0]):
            own = self.friction[self.candidate == c]
            own_low, own_high = np.quantile(own, TAILS)
            found[c] = low <= own.mean() <= high or own_low <= mean <= own_high
        return found

    def same_friction(self, count: int) -> bool:
        """Whether the ``count`` most probable candidates agree on friction, each by itself.

        Their means then differ by no more than a hundredth, or lie within the 90 % interval of the most
        probable one: not in that over all, which is as wide as they differ.
        """
        own = [self.friction[self.candidate == c] for c in range(count)]
        if any(each.size == 0 for each in own):
            return False
        means = np.array([each.mean() for each in own])
        alike = np.ptp(means) <= settings.SETTINGS.same_friction * np.abs(means).max()
        return bool(alike or not self.say_otherwise(count).any())

    def say_otherwise(self, count: int) -> Mask:
        """Which of the ``count`` most probable have a mean outside the first's 90 % interval, shape (count,).

        One without draws has not.
        """
        own = [self.friction[self.candidate == c] for c in range(count)]
        low, high = np.quantile(own[0], TAILS) if own[0].size else (-np.inf, np.inf)
        return np.array([bool(each.size) and not low <= each.mean() <= high for each in own])


def prior_sensitivity(mixture: CandidateMixture, evaluated: int) -> dict[str, float | None]:
    """Shift of friction's mean in its own standard deviations, of sets of so many effects ``evaluated``.

    By the factor on the scale of the priors, and with half and twice the number of effects expected. None
    where too few of the draws would count, or a few far ones too much: the posterior with those priors lies
    elsewhere. Nuisances too slight to show (:mod:`friction_bayes.loop.mixture.slight_effects`) keep their
    size.
    """
    # effects that are certain are in all sets, and make one factor; a draw without a set counts as of none
    effects = np.append([len(names) for names in mixture.sets], 0)[mixture.candidate]
    count, squares = np.count_nonzero(mixture.scores, axis=1), np.sum(mixture.scores**2, axis=1)
    ratios = {
        f"{factor:g}": -count * math.log(factor) - 0.5 * squares * (factor**-2 - 1.0) for factor in _FACTORS
    } | {
        name: log_probability(effects, evaluated, expected) - log_probability(effects, evaluated)
        for name, expected in _EXPECTED.items()
    }
    sd = float(mixture.friction.std(ddof=1))
    found: dict[str, float | None] = {}
    for name, log_ratio in ratios.items():
        weight = special.softmax(log_ratio)
        mean = float(weight @ mixture.friction)
        error = float(np.linalg.norm(weight * (mixture.friction - mean)))
        enough = 1.0 / float(weight @ weight) > _LEAST_DRAWS and error < _LARGEST_ERROR * sd
        found[name] = (mean - float(mixture.friction.mean())) / sd if enough else None
    return found
