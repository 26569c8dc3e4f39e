"""The posterior over all candidates, and friction averaged over them.

Every candidate has its evidence on one scale, so that the posterior is one mixture. Numbers of the record are
summaries of that mixture; residuals and parameters, which belong to one law, are reported for the most
probable candidate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.summary import TAILS
from friction_bayes.loop import settings
from friction_bayes.loop.mixture.cells import Names
from friction_bayes.loop.mixture.slight_effects import SlightForce

__all__ = ["CandidateMixture", "ranked"]

_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""


def ranked(probability: Mapping[Names, float]) -> tuple[tuple[Names, ...], Array]:
    """The candidates that are listed, most probable first, and their probabilities.

    Parameters
    ----------
    probability : mapping of frozenset of str to float
        Of each candidate, or in proportion to it; the empty set is listed whatever its own.
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
    frequency : ndarray, shape (k,)
        Natural frequency [rad/s].
    random_force, correlation_time : ndarray, shape (k,)
        Sd of the random force [N or N m], zero without one, and its correlation time [s].
    coefficients : ndarray of int, shape (k,)
        How many coefficients of effects each draw has whose prior is normal.
    squares : ndarray, shape (k,)
        Sum of their squares, in variances of the prior.
    """

    sets: tuple[Names, ...]
    probabilities: Array
    candidate: Integers
    friction: Array
    frequency: Array
    random_force: Array
    correlation_time: Array
    coefficients: Integers
    squares: Array

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
