"""What a distribution says of itself by its quantiles and its variance, as frozen ones of scipy.stats do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import probability

__all__ = ["FrozenDistribution", "crossed"]

_STEPS = 200
"""Parts of a bracket taken away; a dozen are enough unless a quantile lies close to zero or in a step."""


def crossed(low: Array, high: Array, beyond: Callable[[Array], Array]) -> Array:
    """The least values at which functions that never fall are not negative, by narrowing brackets.

    By inverse quadratic interpolation where that is safe, else by halving (Chandrupatla 1997).

    Parameters
    ----------
    low, high : ndarray, shape (m,)
        Ends of the brackets, at which the functions are taken to be negative and not.
    beyond : callable, (m,) -> (m,)
        The functions.
    """
    # the newest end, the other one, and the one before the newest, with the functions there
    x, other = np.asarray(high, dtype=np.float64), np.asarray(low, dtype=np.float64)
    at, at_other = beyond(x), beyond(other)
    before, at_before, part = other, at_other, np.full(x.shape, 0.5)
    reached = np.ones(x.shape, dtype=np.bool_)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_STEPS):
            width = other - x
            nearest = 2.0 * np.spacing(np.maximum(np.abs(x), np.abs(other)))
            apart = np.abs(width) > nearest
            if not apart.any():
                break
            part = np.clip(part, nearest / np.abs(width), 1.0 - nearest / np.abs(width))
            trial = np.where(apart, x + part * width, x)
            at_trial = beyond(trial)
            same = (at_trial >= 0.0) == reached
            before, at_before = np.where(same, x, other), np.where(same, at, at_other)
            other, at_other = np.where(same, other, x), np.where(same, at_other, at)
            x, at, reached = trial, at_trial, at_trial >= 0.0
            place, level = (x - other) / (before - other), (at - at_other) / (at_before - at_other)
            part = at / (at_other - at) * at_before / (at_other - at_before) + (before - x) / (other - x) * (
                at / (at_before - at) * at_other / (at_before - at_other)
            )
            safe = (level**2 < place) & ((1.0 - level) ** 2 < 1.0 - place)
            part = np.where(safe & np.isfinite(part), part, 0.5)
    return np.where(reached, x, other)


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
