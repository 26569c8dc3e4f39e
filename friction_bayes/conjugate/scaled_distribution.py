"""Distributions times a positive factor, known exactly or to a standard deviation: one, or many at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import expit, logsumexp

from friction_bayes.conjugate.frozen import FrozenDistribution
from friction_bayes.conjugate.mixture import Mixture
from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import non_negative, positive

__all__ = ["ScaledDistribution", "kept_positive", "scaled", "scaled_moments", "scaled_quantiles"]


_STEP = 0.25
_LOGITS = np.arange(-36.0, 36.0 + 0.5 * _STEP, _STEP)
_PROBABILITIES = expit(_LOGITS)
_WEIGHTS = _STEP * _PROBABILITIES * expit(-_LOGITS)
_LOG_WEIGHTS = np.log(_WEIGHTS)
_MAX_STEPS = 100


def scaled(distribution: Any, factor: float, *, relative_sd: float = 0.0) -> Any:
    """Distribution of ``factor`` times a variable.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution or Mixture
        Of the variable.
    factor : float
        Mean of the factor, > 0.
    relative_sd : float
        Its standard deviation over ``factor``; zero when it is exact.

    Returns
    -------
    frozen scipy.stats distribution, Mixture or ScaledDistribution
        The same kind of frozen distribution when the factor is exact.

    Raises
    ------
    InputError
        If ``factor`` is not positive or ``relative_sd`` is negative.
    """
    factor = positive("factor", factor)
    if non_negative("relative_sd", relative_sd) > 0.0:
        return ScaledDistribution(distribution, factor, relative_sd)
    if isinstance(distribution, Mixture):
        return distribution.scaled(factor)
    count = distribution.dist.numargs
    shapes, location = distribution.args[:count], distribution.args[count:]
    keywords = {**distribution.kwds, **dict(zip(("loc", "scale"), location, strict=False))}
    keywords["loc"] = keywords.get("loc", 0.0) * factor
    keywords["scale"] = keywords.get("scale", 1.0) * factor
    return distribution.dist(*shapes, **keywords)


def scaled_moments(mean: Array, sd: Array, factor: float, relative_sd: float) -> tuple[Array, Array]:
    """Mean and standard deviation of many variables times a factor; see :func:`scaled`.

    Parameters
    ----------
    mean, sd : ndarray, shape (m,)
        Of the variables.
    factor, relative_sd : float
        Mean of the factor and its standard deviation over it; zero when exact.
    """
    if relative_sd == 0.0:
        return mean * factor, sd * factor
    positive_factor = kept_positive(factor, relative_sd)
    return mean * float(positive_factor.mean()), np.sqrt(_variance(mean, sd**2, positive_factor))


def scaled_quantiles(
    family: Any, parameters: Sequence[Array], factor: float, relative_sd: float, q: float
) -> Array:
    """Quantile of many variables times a factor; see :func:`scaled`.

    Parameters
    ----------
    family : scipy.stats continuous distribution
        Of the variables.
    parameters : sequence of ndarray, shape (m,)
        Its shapes, location and scale; nan gives nan.
    factor, relative_sd : float
        Mean of the factor and its standard deviation over it; zero when exact.
    q : float
        Probability.
    """
    plain = np.asarray(family.ppf(q, *parameters))
    if relative_sd == 0.0:
        return plain * factor
    result = np.full(plain.shape, np.nan)
    usable = np.isfinite(plain)
    averaged_over_factor = _factor_is_narrow(family(*parameters), relative_sd)
    for rows in (usable & averaged_over_factor, usable & ~averaged_over_factor):
        if rows.any():
            chosen = family(*(parameter[rows, None] for parameter in parameters))
            result[rows] = ScaledDistribution(chosen, factor, relative_sd).ppf(np.full(np.sum(rows), q))
    return result


def kept_positive(factor: float, relative_sd: float) -> Any:
    """Frozen normal distribution of a factor, cut at zero."""
    return stats.truncnorm(-1.0 / relative_sd, np.inf, loc=factor, scale=factor * relative_sd)


def _variance(mean: Any, variance: Any, factor: Any) -> Any:
    """Variance of a variable times an independent frozen distribution."""
    factor_variance, factor_mean = float(factor.var()), float(factor.mean())
    return variance * (factor_variance + factor_mean**2) + factor_variance * mean**2


def _factor_is_narrow(distribution: Any, relative_sd: float) -> Any:
    """Whether the factor is relatively the narrower variable, or not much the wider one."""
    low, middle, high = (distribution.ppf(p) for p in (0.25, 0.5, 0.75))
    return relative_sd * np.abs(middle) <= 2.0 * (high - low)


class ScaledDistribution(FrozenDistribution):
    """Product of a variable and an independent normal factor, the factor kept above zero.

    Probabilities are exact up to quadrature: given one of the two variables the other's distribution is
    merely scaled, and that is averaged over the first by the trapezoidal rule in the logit of its
    probability, which converges geometrically. It is averaged over the factor, unless the variable is
    relatively so much narrower that its distribution would not be smooth between the nodes of the factor;
    errors of ``cdf`` stay below 1e-9.

    Parameters
    ----------
    distribution : frozen scipy.stats distribution
        Of the variable. With parameters of shape (m, 1), all narrower or all wider than the factor, it is
        that of m variables: arguments and results of probabilities and quantiles then have shape
        (m,).
    factor : float
        Mean of the factor before it is kept above zero, > 0.
    relative_sd : float
        Its standard deviation over ``factor``, > 0.
    """

    def __init__(self, distribution: Any, factor: float, relative_sd: float) -> None:
        self.distribution = distribution
        self.factor: Any = kept_positive(factor, relative_sd)
        narrow_factor = np.all(_factor_is_narrow(distribution, relative_sd))
        inner: Any
        self._outer: Any
        inner, self._outer = (self.factor, distribution) if narrow_factor else (distribution, self.factor)
        upper = _LOGITS > 0.0
        # each from its own tail
        self._nodes = np.concatenate(
            [inner.ppf(_PROBABILITIES[~upper]), inner.isf(_PROBABILITIES[::-1][upper])], axis=-1
        )

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

    def mean(self) -> float:
        """Mean."""
        return float(self.distribution.mean() * self.factor.mean())

    def var(self) -> float:
        """Variance; infinite or nan where that of the variable is."""
        return float(_variance(self.distribution.mean(), self.distribution.var(), self.factor))

    def support(self) -> tuple[float, float]:
        """Ends of the support."""
        low, high = self.distribution.support()
        return (-np.inf if np.any(low < 0.0) else 0.0), (np.inf if np.any(high > 0.0) else 0.0)

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
        target = np.atleast_1d(np.asarray(q, dtype=np.float64))
        inside = (target > 0.0) & (target < 1.0)
        p = np.where(inside, target, 0.5)
        x, low, high = self._start(p, upper)
        width = high - low
        active = inside
        for _ in range(_MAX_STEPS):
            excess = (p - probability_of(x)) if upper else (probability_of(x) - p)
            low, high = np.where(excess < 0.0, x, low), np.where(excess < 0.0, high, x)
            density = np.asarray(self.pdf(x))
            newton = x - np.divide(excess, density, out=np.full_like(x, np.inf), where=density > 0.0)
            following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
            following = np.where(active, following, x)
            active = active & (np.abs(following - x) > 1e-13 * width) & (excess != 0.0)
            x = following
            if not active.any():
                break
        at_zero, at_one = reversed(self.support()) if upper else self.support()
        x = np.select([inside, target == 0.0, target == 1.0], [x, at_zero, at_one], np.nan)
        return x.reshape(np.shape(q))[()]

    def _start(self, p: Array, upper: bool) -> tuple[Array, Array, Array]:
        """Starting point and bracket of a quantile.

        Both variables stay below (above) their own quantiles at half the tail with at least the probability
        asked for, and so does their product stay below (above) that of the quantiles.
        """
        below, above = (1.0 - p, p) if upper else (p, 1.0 - p)
        lowest, highest = self._each("ppf", 0.5 * below), self._each("isf", 0.5 * above)
        low = lowest * np.where(lowest < 0.0, self.factor.isf(0.5 * below), self.factor.ppf(0.5 * below))
        high = highest * np.where(highest > 0.0, self.factor.isf(0.5 * above), self.factor.ppf(0.5 * above))
        centre, factor = self._each("ppf", np.full(p.shape, 0.5)), float(self.factor.median())
        quantile = self._each("isf" if upper else "ppf", p)
        stretch = self.factor.isf(p) if upper else self.factor.ppf(p)
        reach = np.hypot((quantile - centre) * factor, centre * (stretch - factor))
        start = centre * factor + np.where(below < 0.5, -reach, reach)
        return np.where((start > low) & (start < high), start, 0.5 * (low + high)), low, high

    def _each(self, quantile: str, p: Array) -> Array:
        """``ppf`` or ``isf`` of the variable, or of each of the variables."""
        return np.asarray(getattr(self.distribution, quantile)(p[..., None])[..., 0])
