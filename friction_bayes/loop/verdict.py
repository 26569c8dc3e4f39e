"""The verdict in one word, and the candidates that hold 95 % of the probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask

__all__ = [
    "AMBIGUOUS",
    "CREDIBLE_MASS",
    "UNEXPLAINED",
    "credible_candidates",
    "credible_count",
    "verdict",
]

CREDIBLE_MASS = 0.95
AMBIGUOUS = "ambiguous"
UNEXPLAINED = "unexplained"


def credible_count(probabilities: ArrayLike) -> int:
    """Count the candidates, most probable first, that hold 95 % together."""
    return int(np.searchsorted(np.cumsum(probabilities), CREDIBLE_MASS) + 1)


def credible_candidates(candidates: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """Of a report's ``candidates``, most probable first, those that hold 95 % together."""
    return candidates[: credible_count([candidate["probability"] for candidate in candidates])]


def verdict(
    sets: Sequence[frozenset[str]], probabilities: Array, agrees: Mask, is_noise: bool, rubs: float
) -> str:
    """Return the verdict.

    Coulomb friction alone is adequate where what holds 95 % agrees on friction: another effect may then act
    or not. Nor is it where that friction itself is as uncertain: with so wide an interval all agree. An
    effect explains a record where it holds as much by itself.

    Parameters
    ----------
    sets : sequence of frozenset of str
        Candidates, most probable first.
    probabilities : ndarray, shape (candidates,)
    agrees : ndarray of bool, shape (candidates,)
        Which of them do not contradict what all of them say of friction.
    is_noise : bool
        Whether every residual test of the most probable candidate passes.
    rubs : float
        Probability that dry friction matters.
    """
    if not is_noise:
        return UNEXPLAINED
    if not sets[0]:
        known = min(float(probabilities[agrees].sum()), rubs) >= CREDIBLE_MASS
        return "adequate" if known else AMBIGUOUS
    return "explained" if probabilities[0] >= CREDIBLE_MASS else AMBIGUOUS
