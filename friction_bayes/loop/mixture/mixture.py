"""The posterior over all candidates, and friction averaged over them.

Every candidate has its evidence on one scale, so that the posterior is one mixture. Numbers of the record are
summaries of that mixture; residuals and parameters, which belong to one law, are reported for the most
probable candidate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.summary import TAILS
from friction_bayes.loop import settings
from friction_bayes.loop.mixture.candidate_draws import CandidateDraws
from friction_bayes.loop.mixture.candidates import Candidates
from friction_bayes.loop.mixture.cells import Names

__all__ = ["CandidateMixture", "mixture_of"]

_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CandidateMixture:
    """The posterior over the candidates.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Candidates, most probable first; the empty set is always among them.
    probabilities : ndarray, shape (c,)
    of : Candidates
        Reports on the most probable one.
    draws : CandidateDraws
        Their ``candidate`` counts in ``sets``; -1 where that is not listed.
    """

    sets: tuple[Names, ...]
    probabilities: Array
    of: Candidates
    draws: CandidateDraws

    def probability(self, name: str) -> float:
        """Probability that an effect acts."""
        return min(float(self.probabilities[[name in names for names in self.sets]].sum()), 1.0)

    @property
    def agrees(self) -> Mask:
        """Which candidates agree with the friction averaged over all, shape (c,).

        One agrees where its mean lies within the 90 % interval over all, or the mean over all within its own;
        one without draws does not.
        """
        friction = self.draws.friction
        low, high, mean = *np.quantile(friction, TAILS), friction.mean()
        found = np.zeros(len(self.sets), dtype=bool)
        for c in np.unique(self.draws.candidate[self.draws.candidate >= 0]):
            own = friction[self.draws.candidate == c]
            own_low, own_high = np.quantile(own, TAILS)
            found[c] = low <= own.mean() <= high or own_low <= mean <= own_high
        return found

    def same_friction(self, count: int) -> bool:
        """Whether the ``count`` most probable candidates agree on friction, each by itself.

        Their means then differ by no more than a hundredth, or lie within the 90 % interval of the most
        probable one: not in that over all, which is as wide as they differ.
        """
        own = [self.draws.friction[self.draws.candidate == c] for c in range(count)]
        if any(each.size == 0 for each in own):
            return False
        means = np.array([each.mean() for each in own])
        alike = np.ptp(means) <= settings.SETTINGS.same_friction * np.abs(means).max()
        return bool(alike or not self.say_otherwise(count).any())

    def say_otherwise(self, count: int) -> Mask:
        """Which of the ``count`` most probable have a mean outside the first's 90 % interval, shape (count,).

        One without draws has not.
        """
        own = [self.draws.friction[self.draws.candidate == c] for c in range(count)]
        low, high = np.quantile(own[0], TAILS) if own[0].size else (-np.inf, np.inf)
        return np.array([bool(each.size) and not low <= each.mean() <= high for each in own])


def mixture_of(candidates: Candidates, rng: np.random.Generator) -> CandidateMixture:
    """The mixture of candidates by their evidence, with a random force too slight to show in addition."""
    probability = candidates.probabilities
    listed = [
        c for c, names in enumerate(candidates.sets) if probability[c] > _LEAST_PROBABILITY or not names
    ]
    place = np.full(probability.size, -1)
    place[listed] = np.arange(len(listed))
    draws = candidates.draws
    draws = replace(draws, candidate=place[draws.candidate])
    if candidates.slight_force is not None:
        still = draws.random_force == 0.0
        friction = np.where(still, candidates.slight_force.added_to(draws.friction, rng), draws.friction)
        draws = replace(draws, friction=friction)
    return CandidateMixture(
        sets=tuple(candidates.sets[c] for c in listed),
        probabilities=probability[listed] / probability[listed].sum(),
        of=candidates,
        draws=draws,
    )
