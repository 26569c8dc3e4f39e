"""What a distribution says of itself by its quantiles and its variance, as frozen ones of scipy.stats do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.checks import probability

__all__ = ["FrozenDistribution"]


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
