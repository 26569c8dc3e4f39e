"""Candidates of an analysis along measured motions: sets of columns, under a random force or none.

The analysis evaluates points of a grid over the random force, and sets of columns; one candidate comprises
all of those with the same effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_clipping import SENSOR_CLIPPING

__all__ = ["Cells", "Names", "cells_of"]

Names = frozenset[str]

_LEAST = 1e-12
"""Least share of the total probability that counts."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Probability of each set of columns at each point of the grid.

    Attributes
    ----------
    weight : ndarray, shape (j, g, m)
        Probability of points and sets under each kind of noise; zero where that is no candidate. The sum need
        not be one.
    forced : ndarray of bool, shape (g,)
        Points with a random force.
    effects : sequence of frozenset of str, length m
        Effects of each set of columns.
    noises : sequence of frozenset of str, length j
        Effects of each kind of noise.
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
        """Distinct sets of effects, and the index of that of each set of columns, shape (m,)."""
        different = list(dict.fromkeys(self.effects))
        place = {names: i for i, names in enumerate(different)}
        return different, np.array([place[names] for names in self.effects])

    @cached_property
    def probabilities(self) -> dict[Names, float]:
        """Probability of each candidate that counts."""
        different, which = self._sets
        found: dict[Names, float] = {}
        for noise, weight in zip(self.noises, self.weight, strict=True):
            for forced in (False, True):
                some = weight[self.forced == forced].sum(axis=0)
                sums = np.bincount(which, some, len(different))
                for i in np.flatnonzero(sums > _LEAST * self.weight.sum()):
                    found[self._names(different[i], forced, noise)] = float(sums[i])
        return found

    @staticmethod
    def _names(effects: Names, forced: int, noise: Names) -> Names:
        return effects | noise | ({RANDOM_FORCE.name} if forced else set())

    def places(self, sets: Sequence[Names]) -> Integers:
        """Index of the candidate that each cell belongs to, shape (j, g, m); -1 without one."""
        different, which = self._sets
        place = {names: i for i, names in enumerate(sets)}
        table = np.array(
            [
                [
                    [place.get(self._names(names, forced, noise), -1) for names in different]
                    for forced in (0, 1)
                ]
                for noise in self.noises
            ]
        )
        return np.asarray(table[:, self.forced.astype(int)][:, :, which])


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
    """All sets that the samples can determine and whose friction resists, under each kind of noise."""
    nothing = set.intersection(*(_unknowable(one) for one in fit.alone))
    known = np.array([not names & nothing for names in fit.sets.effects]) & ~fit.impossible
    certain = frozenset({SENSOR_CLIPPING.name} if any(one.segment.clipped for one in fit.alone) else ())
    noises = {certain: 1.0}
    for one in fit.alone:
        # what one record's sensor has, the records have
        pairs = list(product(noises.items(), one.sensor_noise.probabilities(len(fit.alone)).items()))
        noises = dict.fromkeys((names | more for (names, _), (more, _) in pairs), 0.0)
        for (names, share), (more, probability) in pairs:
            noises[names | more] += share * probability
    weights = [probability * known * fit.weight for probability in noises.values()]
    return Cells(np.array(weights), fit.posterior.ratio > 0.0, fit.sets.effects, list(noises))
