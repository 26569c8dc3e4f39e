"""A frozen distribution times a positive factor, known exactly or to a standard deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import expit, logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import non_negative, positive, probability

__all__ = ["ScaledDistribution", "scaled"]


_STEP = 0.25
_LOGITS = np.arange(-36.0, 36.0 + 0.5 * _STEP, _STEP)
_PROBABILITIES = expit(_LOGITS)
_WEIGHTS = _STEP * _PROBABILITIES * expit(-_LOGITS)
_LOG_WEIGHTS = np.log(_WEIGHTS)


def scaled(distribution: Any, factor: float, *, relative_sd: float = 0.0) -> Any:
    """Distribution of ``factor`` times a variable.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution
        Of the variable.
    factor : float
        Mean of the factor, > 0.
    relative_sd : float
        Its standard deviation over ``factor``; zero when it is exact.

    Returns
    -------
    frozen scipy.stats distribution or ScaledDistribution
        The same kind of frozen distribution when the factor is exact.

    Raises
    ------
    InputError
        If ``factor`` is not positive or ``relative_sd`` is negative.
    """
    factor = positive("factor", factor)
    if non_negative("relative_sd", relative_sd) > 0.0:
        return ScaledDistribution(distribution, factor, relative_sd)
    count = distribution.dist.numargs
    shapes, location = distribution.args[:count], distribution.args[count:]
    keywords = {**distribution.kwds, **dict(zip(("loc", "scale"), location, strict=False))}
    keywords["loc"] = keywords.get("loc", 0.0) * factor
    keywords["scale"] = keywords.get("scale", 1.0) * factor
    return distribution.dist(*shapes, **keywords)


class ScaledDistribution:
    """Product of a variable and an independent normal factor, the factor kept above zero.

    Has the methods of a frozen scipy.stats distribution. Probabilities are exact up to quadrature: given one
    of the two variables the other's distribution is merely scaled, and that is averaged over the first by the
    trapezoidal rule in the logit of its probability, which converges geometrically. It is averaged over the
    factor, unless the variable is relatively so much narrower that its distribution would not be smooth
    between the nodes of the factor; errors of ``cdf`` stay below 1e-9.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution
        Of the variable.
    factor : float
        Mean of the factor before it is kept above zero, > 0.
    relative_sd : float
        Its standard deviation over ``factor``, > 0.
    """

    def __init__(self, distribution: Any, factor: float, relative_sd: float) -> None:
        self.distribution = distribution
        sd = factor * relative_sd
        self.factor: Any = stats.truncnorm(-1.0 / relative_sd, np.inf, loc=factor, scale=sd)
        low, middle, high = distribution.ppf([0.25, 0.5, 0.75])
        narrow_factor = relative_sd * abs(middle) <= 2.0 * (high - low)
        inner: Any
        self._outer: Any
        inner, self._outer = (self.factor, distribution) if narrow_factor else (distribution, self.factor)
        upper = _LOGITS > 0.0
        self._nodes = np.where(upper, inner.isf(_PROBABILITIES[::-1]), inner.ppf(_PROBABILITIES))

    def cdf(self, x: ArrayLike) -> Any:
        """Cumulative probability."""
        return self._average(x, lambda z, v: np.where(v > 0.0, self._outer.cdf(z), self._outer.sf(z)))

    def sf(self, x: ArrayLike) -> Any:
        """Probability above ``x``."""
        return self._average(x, lambda z, v: np.where(v > 0.0, self._outer.sf(z), self._outer.cdf(z)))

    def pdf(self, x: ArrayLike) -> Any:
        """Density."""
        return self._average(x, lambda z, v: self._outer.pdf(z) / np.abs(v))

    def logpdf(self, x: ArrayLike) -> Any:
        """Log-density."""
        z = np.asarray(x, dtype=np.float64)[..., None] / self._nodes
        terms = self._outer.logpdf(z) - np.log(np.abs(self._nodes))
        return logsumexp(terms + _LOG_WEIGHTS, axis=-1)[()]

    def ppf(self, q: ArrayLike) -> Any:
        """Quantile: ``x`` with ``cdf(x) = q``."""
        return self._solve(q, self.cdf, upper=False)

    def isf(self, q: ArrayLike) -> Any:
        """Upper quantile: ``x`` with ``sf(x) = q``."""
        return self._solve(q, self.sf, upper=True)

    def median(self) -> float:
        """Median."""
        return float(self.ppf(0.5))

    def interval(self, confidence: float) -> tuple[float, float]:
        """Equal-tailed interval of the given probability."""
        tail = 0.5 * (1.0 - probability("confidence", confidence))
        return float(self.ppf(tail)), float(self.isf(tail))

    def mean(self) -> float:
        """Mean."""
        return float(self.distribution.mean() * self.factor.mean())

    def var(self) -> float:
        """Variance; infinite or nan where that of the variable is."""
        variance, mean = float(self.distribution.var()), float(self.distribution.mean())
        factor_variance, factor_mean = float(self.factor.var()), float(self.factor.mean())
        return variance * (factor_variance + factor_mean**2) + factor_variance * mean**2

    def std(self) -> float:
        """Standard deviation."""
        return float(np.sqrt(self.var()))

    def support(self) -> tuple[float, float]:
        """Ends of the support."""
        low, high = self.distribution.support()
        return (-np.inf if low < 0.0 else 0.0), (np.inf if high > 0.0 else 0.0)

    def rvs(self, size: int | tuple[int, ...] = 1, random_state: np.random.Generator | None = None) -> Array:
        """Draws, from a generator that must be given."""
        if random_state is None:
            raise TypeError("rvs needs random_state: give a numpy Generator")
        factor = self.factor.rvs(size, random_state=random_state)
        return factor * self.distribution.rvs(size, random_state=random_state)

    def _average(self, x: ArrayLike, conditional: Callable[[Array, Array], Array]) -> Any:
        z = np.asarray(x, dtype=np.float64)[..., None] / self._nodes
        return (conditional(z, self._nodes) @ _WEIGHTS)[()]

    def _solve(self, q: ArrayLike, probability_of: Callable[[ArrayLike], Any], upper: bool) -> Any:
        """Invert a monotone probability by Newton steps kept inside a bracket."""
        target = np.asarray(q, dtype=np.float64)
        wanted = target.ravel()
        inside = np.flatnonzero((wanted > 0.0) & (wanted < 1.0))
        result = np.full(wanted.shape, np.nan)
        result[wanted == (1.0 if upper else 0.0)], result[wanted == (0.0 if upper else 1.0)] = self.support()
        x, low, high = self._start(wanted[inside], upper)
        width = high - low
        for _ in range(100):
            p = wanted[inside]
            excess = (p - probability_of(x)) if upper else (probability_of(x) - p)
            low, high = np.where(excess < 0.0, x, low), np.where(excess < 0.0, high, x)
            density = self.pdf(x)
            newton = x - np.divide(excess, density, out=np.full_like(x, np.inf), where=density > 0.0)
            following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
            result[inside] = following
            active = (np.abs(following - x) > 1e-13 * width) & (excess != 0.0)
            if not active.any():
                break
            inside, x, low, high, width = (a[active] for a in (inside, following, low, high, width))
        return result.reshape(target.shape)[()]

    def _start(self, p: Array, upper: bool) -> tuple[Array, Array, Array]:
        """Starting point and bracket of a quantile.

        Both variables stay below (above) their own quantiles at half the tail with at least the probability
        asked for, and so does their product stay below (above) that of the quantiles.
        """
        below, above = (1.0 - p, p) if upper else (p, 1.0 - p)
        lowest, highest = self.distribution.ppf(0.5 * below), self.distribution.isf(0.5 * above)
        low = lowest * np.where(lowest < 0.0, self.factor.isf(0.5 * below), self.factor.ppf(0.5 * below))
        high = highest * np.where(highest > 0.0, self.factor.isf(0.5 * above), self.factor.ppf(0.5 * above))
        centre, factor = float(self.distribution.median()), float(self.factor.median())
        quantile = self.distribution.isf(p) if upper else self.distribution.ppf(p)
        stretch = self.factor.isf(p) if upper else self.factor.ppf(p)
        reach = np.hypot((quantile - centre) * factor, centre * (stretch - factor))
        start = centre * factor + np.where(below < 0.5, -reach, reach)
        return np.where((start > low) & (start < high), start, 0.5 * (low + high)), low, high
