"""Candidates that share a likelihood, as the report wants them, and one posterior of several such families.

Every candidate of every family has its evidence on one scale, so that the posterior is one mixture over all.
Numbers of the record are summaries of that mixture; what can only be told of one law, its residual and its
parameters, is told of the most probable candidate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.summary import TAILS
from friction_bayes.loop import settings
from friction_bayes.loop.checks.search_forecast import Forecast
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.report.friction_range import Reading
from friction_bayes.loop.report.next_experiment import Contender
from friction_bayes.loop.report.reference_force import ResistingForce
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.loop.search.draws import DRAWS, shared_out
from friction_bayes.loop.search.residual_tests import ResidualTests

__all__ = ["Family", "FamilyDraws", "Mixture", "Nuisance", "mixture_of"]

Names = frozenset[str]

_LEAST_PROBABILITY = 1e-9
"""Of a candidate that is listed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyDraws:
    """Draws from the posterior of a family, each candidate in proportion to its probability.

    Attributes
    ----------
    candidate : ndarray of int, shape (k,)
        Which of the family's sets each draw has.
    friction : ndarray, shape (k,)
        Friction force of the declared system [N or N m].
    frequency : ndarray, shape (k,)
        Natural frequency [rad/s].
    random_force, correlation_time : ndarray, shape (k,)
        Sd of the random force [N or N m], zero where there is none, and its correlation time [s].
    coefficients : ndarray of int, shape (k,)
        How many coefficients of effects each draw has whose prior is normal.
    squares : ndarray, shape (k,)
        Sum of their squares, in variances of the prior.
    """

    candidate: Integers
    friction: Array
    frequency: Array
    random_force: Array
    correlation_time: Array
    coefficients: Integers
    squares: Array

    def at(self, index: Integers | Mask) -> FamilyDraws:
        """Some of the draws."""
        return FamilyDraws(**{name: values[index] for name, values in vars(self).items()})


class Nuisance(Protocol):
    """What friction has to answer for without its being in the law."""

    def beside(self, friction: Array, rng: np.random.Generator) -> Array:
        """Draws of friction, shape (k,), with it beside some of them."""
        ...


class Family(Protocol):
    """Candidates that share a likelihood.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Effects of each candidate.
    log_weights : ndarray, shape (c,)
        Log evidence with the log prior of each, on the scale that all families share.
    draws : FamilyDraws
        Of :data:`friction_bayes.loop.search.draws.DRAWS` draws.
    reading : Reading
        Friction by all that it weighs, what it refuses as an explanation too.
    tests : ResidualTests
        Of what the most probable candidate leaves.
    explains : bool
        Whether that is noise, or too little to matter.
    contradicted : bool
        Whether several records contradict each other.
    trail : tuple of str
        The steps that led to them.
    notes : tuple of str
        What a reader must know of the forces that were found.
    fitted : tuple of int
        Samples of the first record that were fitted, from its start, turning points among them, and how many
        of the samples were set aside.
    holds_what_is_left : bool
        Whether its draws of friction hold how far that could shift for what the law does not say.
    slight_force : Nuisance or None
        A random force too slight to show, for draws of all families without one; None where it knows of none.
    """

    sets: tuple[Names, ...]
    log_weights: Array
    trail: tuple[str, ...]
    holds_what_is_left: bool

    @property
    def slight_force(self) -> Nuisance | None: ...

    @property
    def draws(self) -> FamilyDraws: ...

    @property
    def reading(self) -> Reading: ...

    @property
    def tests(self) -> ResidualTests: ...

    @property
    def explains(self) -> bool: ...

    @property
    def contradicted(self) -> bool: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    @property
    def fitted(self) -> tuple[int, int, int]: ...

    def parameters(self, name: str) -> dict[str, dict[str, Any]]:
        """Mean, sd and unit of the parameters of an effect of the most probable candidate."""
        ...

    def lines(self, name: str) -> list[dict[str, Any]]:
        """Every line of an effect of the most probable candidate, by record; empty where it is none.

        Each as :func:`friction_bayes.loop.report.effect_summaries.line_summary` has it.
        """
        ...

    def variables(self) -> dict[str, Array]:
        """Draws of every parameter of the most probable candidate by name, shape (k,) each."""
        ...

    def left(self) -> dict[str, Any]:
        """What the most probable candidate leaves; a shift of friction in the unit of force [N or N m]."""
        ...

    def check(self, seed: int) -> tuple[dict[str, Any], xr.DataTree | None]:
        """Compare the posterior of the most probable candidate with a sampler's.

        The ``share`` of the candidate says how much of it was sampled; the tree is what was sampled, if
        anything.
        """
        ...

    def witnesses(self) -> dict[str, Any] | None:
        """Friction by the loss of amplitude and by the shape within a cycle; None where not compared."""
        ...

    def between_records(self) -> dict[str, Any] | None:
        """Friction of each record and its spread between them; None where it is one friction."""
        ...

    def noise(self) -> dict[str, Any]:
        """Model, sd and correlation length of the sensor's noise."""
        ...

    def forecasts(self) -> tuple[Forecast, ...]:
        """The rest of each record by the most probable candidate; empty where that cannot be forecast."""
        ...

    def noise_floor(self) -> float:
        """Root mean square of what the most probable candidate leaves, in the unit of the signal."""
        ...

    def traces(self) -> tuple[RecordTrace, ...]:
        """Each record with the most probable candidate."""
        ...

    def simulated(self) -> tuple[LoopModel, Array]:
        """Model that can be simulated, nearest to the records, and its coordinates."""
        ...

    def resisting_force(self) -> ResistingForce:
        """Of the first record, by the most probable candidate."""
        ...

    def contender(self, names: Names) -> Contender | None:
        """One of its sets as far as it predicts a further record; None where too little is drawn of it."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixture:
    """The posterior over the candidates of all families.

    Attributes
    ----------
    sets : tuple of frozenset of str, length c
        Candidates, most probable first; the empty set is always among them.
    probabilities : ndarray, shape (c,)
    best : Family
        Of the most probable candidate.
    draws : FamilyDraws
        Their ``candidate`` counts in ``sets``; -1 where that is not listed.
    share_of_best : float
        Probability of the most probable candidate in the family of that: another may have it too.
    """

    sets: tuple[Names, ...]
    probabilities: Array
    best: Family
    draws: FamilyDraws
    share_of_best: float

    def probability(self, name: str) -> float:
        """Probability that an effect acts."""
        return min(float(self.probabilities[[name in names for names in self.sets]].sum()), 1.0)

    @property
    def agrees(self) -> Mask:
        """Which candidates do not contradict what all of them say of friction, shape (c,).

        One agrees where its mean lies within the 90 % interval over all, or the mean over all within its own;
        one of which nothing is drawn does not.
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
        """Which of the ``count`` most probable have a mean beyond the first's 90 %, shape (count,).

        One of which nothing is drawn has not.
        """
        own = [self.draws.friction[self.draws.candidate == c] for c in range(count)]
        low, high = np.quantile(own[0], TAILS) if own[0].size else (-np.inf, np.inf)
        return np.array([bool(each.size) and not low <= each.mean() <= high for each in own])

    def with_friction(self, friction: Array) -> Mixture:
        """The same with other draws of friction, shape (k,), which belong to none of the candidates."""
        nobody = np.full_like(self.draws.candidate, -1)
        return replace(self, draws=replace(self.draws, friction=friction, candidate=nobody))


def mixture_of(
    families: Sequence[Family], rng: np.random.Generator, slight_force: Nuisance | None = None
) -> Mixture:
    """Mix families in proportion to their evidence.

    Parameters
    ----------
    families : sequence of Family
        One has the empty set. A set in two of them is one candidate.
    rng : numpy.random.Generator
    slight_force : Nuisance, optional
        A random force too slight to show, for draws without one.
    """
    logs = np.concatenate([family.log_weights for family in families])
    probability = np.exp(logs - logs.max())
    probability /= probability.sum()
    owner = np.repeat(np.arange(len(families)), [len(family.sets) for family in families])
    everyone = [names for family in families for names in family.sets]
    total: dict[Names, float] = {}
    for names, each in zip(everyone, probability, strict=True):
        total[names] = total.get(names, 0.0) + float(each)
    ranked = sorted(total, key=lambda names: -total[names])
    listed = [names for names in ranked if total[names] > _LEAST_PROBABILITY or not names]
    position = {names: k for k, names in enumerate(listed)}
    place = np.array([position.get(names, -1) for names in everyone])
    counts = shared_out(DRAWS, np.array([probability[owner == f].sum() for f in range(len(families))]), rng)
    parts = []
    for f, (family, count) in enumerate(zip(families, counts, strict=True)):
        # as evenly among its candidates, which come one after the other
        some = family.draws.at(shared_out(count, np.ones(DRAWS), rng) > 0)
        parts.append(vars(some) | {"candidate": place[owner == f][some.candidate]})
    kept = np.array([total[names] for names in listed])
    draws = FamilyDraws(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})
    if slight_force is not None:
        still = draws.random_force == 0.0
        friction = np.where(still, slight_force.beside(draws.friction, rng), draws.friction)
        draws = replace(draws, friction=friction)
    # what a family tells in detail is of its own most probable set
    leads = np.array([family.sets[0] == listed[0] for family in families])[owner]
    lead = int(np.argmax(np.where(place == 0, probability + leads, -1.0)))
    return Mixture(
        sets=tuple(listed),
        probabilities=kept / kept.sum(),
        best=families[int(owner[lead])],
        draws=draws,
        share_of_best=float(probability[lead]),
    )
