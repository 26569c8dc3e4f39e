"""What a distribution says of itself by its quantiles and its variance, as frozen ones of scipy.stats do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import probability

__all__ = ["FrozenDistribution", "bisected"]

_STEPS = 200
"""Halvings of a bracket; 60 are enough unless a quantile lies close to zero."""


def bisected(low: Array, high: Array, reached: Callable[[Array], Array]) -> Array:
    """The least values that are large enough, shape (m,), by halving brackets.

    Parameters
    ----------
    low, high : ndarray, shape (m,)
        Ends of the brackets.
    reached : callable, (m,) -> (m,)
        Whether values are large enough; if one is, larger ones are.
    """
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        if np.all((middle == low) | (middle == high) | ~np.isfinite(middle)):
            break
        beyond = reached(middle)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return high


class FrozenDistribution(ABC):
    """Distribution of one variable with the methods of a frozen scipy.stats distribution."""

    @abstractmethod
    def ppf(self, q: ArrayLike) -> Any:
        """Quantile."""

    @abstractmethod
    def isf(self, q: ArrayLike) -> Any:
        """Upper quantile."""

    @abstractmethod
    def var(self) -> Any:
        """Variance."""

    def median(self) -> float:
        """Median."""
        return float(self.ppf(0.5))

    def interval(self, confidence: float) -> tuple[float, float]:
        """Equal-tailed interval of the given probability."""
        tail = 0.5 * (1.0 - probability("confidence", confidence))
        return float(self.ppf(tail)), float(self.isf(tail))

    def std(self) -> Any:
        """Standard deviation."""
        return np.sqrt(self.var())
