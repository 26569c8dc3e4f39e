"""Mixture in equal parts of several distributions, of which an unknown one is right."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logsumexp

from friction_bayes.conjugate.frozen import FrozenDistribution, crossed
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array

__all__ = ["EquallyProbable", "equally_probable"]


def equally_probable(parts: Sequence[Any]) -> Any:
    """Mixture in equal parts of distributions of one variable: one part is itself."""
    if len(parts) == 1:
        return parts[0]
    if all(isinstance(part, Mixture) or _is_student(part) for part in parts):
        return Mixture.of(parts, np.full(len(parts), 1.0 / len(parts)))
    return EquallyProbable(parts)


def _is_student(distribution: Any) -> bool:
    return getattr(getattr(distribution, "dist", None), "name", None) == "t"


class EquallyProbable(FrozenDistribution):
    """Mixture of distributions in equal parts.

    Parameters
    ----------
    parts : sequence of frozen distributions
        Those of m variables each give the mixtures of m variables: arguments and results of probabilities and
        quantiles then have shape (m,).
    """

    def __init__(self, parts: Sequence[Any]) -> None:
        self.parts = tuple(parts)

    def _average(self, of_part: Callable[[Any], Any]) -> Any:
        return sum(of_part(part) for part in self.parts) / len(self.parts)

    def cdf(self, x: ArrayLike) -> Any:
        """Cumulative probability."""
        return self._average(lambda part: part.cdf(x))

    def sf(self, x: ArrayLike) -> Any:
        """Probability above ``x``."""
        return self._average(lambda part: part.sf(x))

    def pdf(self, x: ArrayLike) -> Any:
        """Density."""
        return self._average(lambda part: part.pdf(x))

    def logpdf(self, x: ArrayLike) -> Any:
        """Log-density."""
        return logsumexp([part.logpdf(x) for part in self.parts], axis=0) - np.log(len(self.parts))

    def ppf(self, q: ArrayLike) -> Any:
        """Quantile: ``x`` with ``cdf(x) = q``."""
        return self._solve(q, "ppf", lambda x, q: self.cdf(x) - q)

    def isf(self, q: ArrayLike) -> Any:
        """Upper quantile: ``x`` with ``sf(x) = q``."""
        return self._solve(q, "isf", lambda x, q: q - self.sf(x))

    def mean(self) -> Any:
        """Mean."""
        return self._average(lambda part: part.mean())

    def var(self) -> Any:
        """Variance; not finite where that of a part is."""
        centre = self.mean()
        return self._average(lambda part: part.var() + (part.mean() - centre) ** 2)

    def support(self) -> tuple[float, float]:
        """Ends of the support."""
        low, high = zip(*(part.support() for part in self.parts), strict=True)
        return min(low), max(high)

    def rvs(self, size: int | tuple[int, ...] = 1, random_state: np.random.Generator | None = None) -> Array:
        """Draws, from a generator that must be given."""
        if random_state is None:
            raise TypeError("rvs needs random_state: give a numpy Generator")
        draws = [part.rvs(size, random_state=random_state) for part in self.parts]
        return np.choose(random_state.integers(len(draws), size=size), draws)

    def _solve(self, q: ArrayLike, quantile: str, beyond: Callable[[Array, Array], Array]) -> Any:
        """Invert a monotone probability between the quantiles of the parts."""
        ends = np.array([getattr(part, quantile)(q) for part in self.parts])
        p = np.asarray(q, dtype=np.float64)
        return crossed(ends.min(axis=0), ends.max(axis=0), lambda x: beyond(x, p))[()]
