"""Candidates of an analysis along measured motions: sets of columns, under a random force or none.

The analysis knows points of a grid over the random force, and sets of columns; one candidate is all of those
that stand for the same effects.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.text import percent
from friction_bayes.loop.candidate import INCLUSION
from friction_bayes.mechanics.effects import EFFECTS, NoiseEffect
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["LEAST_COUNTED", "Cells"]

Names = frozenset[str]

LEAST_COUNTED = 0.05
"""Probability of an effect that the search does not try below which no candidate has it.

So little can neither keep a law from 95 % nor move friction's interval noticeably; but several effects at a
few per cent each, which a record that says little of them leaves them, would keep any law from that. Of a
kind of noise it is the probability before the record.
"""
_LEAST = 1e-12
"""Share of the probability of all that counts."""


@dataclass(frozen=True, eq=False)
class Cells:
    """How probable each set of columns is at each point of the grid.

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
        """Different sets of effects, and which of them each set of columns is, shape (m,)."""
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
        """Which of some candidates each cell belongs to, shape (j, g, m); -1 where to none."""
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

    def counted(self, own: Iterable[str], log_share: float) -> tuple[Cells, tuple[str, ...]]:
        """Leave out the candidates with effects that are too improbable (see :data:`LEAST_COUNTED`).

        Parameters
        ----------
        own : iterable of str
            Effects that the search does not try.
        log_share : float
            Logarithm of the factor from ``weight`` to probabilities over all families, which may be beyond
            what a float holds where all that counts is improbable here.

        Returns
        -------
        cells : Cells
        steps : tuple of str
            A line on each effect that is left out.
        """
        own = tuple(own)
        own_sums = {name: sum(p for names, p in self.probabilities.items() if name in names) for name in own}
        probability = {
            name: math.exp(log_share + math.log(p)) if p > 0.0 else 0.0 for name, p in own_sums.items()
        }
        # how the noise is distributed moves friction's interval by next to nothing
        least = {name: INCLUSION if isinstance(EFFECTS[name], NoiseEffect) else LEAST_COUNTED for name in own}
        small = {name: p for name, p in probability.items() if p < least[name]}
        steps = (
            f"{name} has a probability of {percent(p)}: left out" for name, p in small.items() if p > 0.0
        )
        return self._without(small.keys()), tuple(steps)

    def _without(self, effects: Iterable[str]) -> Cells:
        """The same without candidates that have any of these effects."""
        unwanted = set(effects)
        kept = np.array([not names & unwanted for names in self.effects])
        weight = self.weight * kept
        if RANDOM_FORCE.name in unwanted:
            weight[:, self.forced] = 0.0
        weight[[bool(noise & unwanted) for noise in self.noises]] = 0.0
        return replace(self, weight=weight)
