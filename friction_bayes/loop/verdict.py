"""One word for what was found, by the rule of the report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["HELD", "credible_count", "verdict"]

HELD = 0.95


def credible_count(probabilities: Array) -> int:
    """How many of the candidates, most probable first, hold 95 % together."""
    return int(np.searchsorted(np.cumsum(probabilities), HELD) + 1)


def verdict(sets: Sequence[frozenset[str]], probabilities: Array, is_noise: bool) -> str:
    """Return the verdict.

    Parameters
    ----------
    sets : sequence of frozenset of str
        Candidates, most probable first.
    probabilities : ndarray, shape (candidates,)
    is_noise : bool
        Whether every residual test of the most probable candidate passes.
    """
    if not is_noise:
        return "unexplained"
    if not sets[0]:
        return "adequate"
    return "explained" if probabilities[0] >= HELD else "ambiguous"
