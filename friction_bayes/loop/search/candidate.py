"""What the search of some records fitted, and how probable each set of effects is."""

from __future__ import annotations

from dataclasses import dataclass

from friction_bayes.core.arrays import Array
from friction_bayes.loop.search.fit import LoopFit

__all__ = ["Candidate", "SearchResult"]

Names = frozenset[str]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A set of effects that was fitted.

    Attributes
    ----------
    effects : frozenset of str
    fit : LoopFit
    log_weight : float
        Log-evidence with the log-prior of the set.
    """

    effects: Names
    fit: LoopFit
    log_weight: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SearchResult:
    """What the search of some records found.

    Attributes
    ----------
    sets : tuple of frozenset of str
        Sets of effects, most probable first.
    fits : tuple of LoopFit
        The fit of each.
    log_weights : ndarray, shape (sets,)
        Log-evidence with the log-prior of each.
    probabilities : ndarray, shape (sets,)
    allowed : tuple of str
        Effects that were tried.
    before : LoopFit
        The Coulomb model alone, its rest position free: a sensor's zero is no misfit of the law.
    ar : tuple of ndarray
        Autoregression of each record's noise; empty where it is white.
    trail : tuple of str
        The steps of the search.
    white : LoopFit
        The most probable under white noise.
    """

    sets: tuple[Names, ...]
    fits: tuple[LoopFit, ...]
    log_weights: Array
    probabilities: Array
    allowed: tuple[str, ...]
    before: LoopFit
    ar: tuple[Array, ...]
    trail: tuple[str, ...]
    white: LoopFit
