"""Many variables of one family times one uncertain factor, for whole arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy import stats
from scipy.special import expit

from friction_bayes.core.arrays import Array

__all__ = ["product_moments", "product_quantiles"]


_STEP = 0.25
_LOGITS = np.arange(-36.0, 36.0 + 0.5 * _STEP, _STEP)
_PROBABILITIES = expit(_LOGITS)
_WEIGHTS = _STEP * _PROBABILITIES * expit(-_LOGITS)
_ITERATIONS = 60


def product_moments(mean: Array, sd: Array, factor: float, relative_sd: float) -> tuple[Array, Array]:
    """Mean and standard deviation of variables times a normal factor kept above zero.

    Parameters
    ----------
    mean, sd : ndarray, shape (m,)
        Of the variables.
    factor, relative_sd : float
        Mean of the factor and its standard deviation over it; zero when exact.
    """
    if relative_sd == 0.0:
        return mean * factor, sd * factor
    positive = _factor(factor, relative_sd)
    centre, variance = float(positive.mean()), float(positive.var())
    return mean * centre, np.sqrt(sd**2 * (variance + centre**2) + variance * mean**2)


def product_quantiles(
    family: Any, parameters: Sequence[Array], factor: float, relative_sd: float, q: float
) -> Array:
    """Quantile of variables times a normal factor kept above zero.

    As in :class:`friction_bayes.conjugate.scaled.ScaledDistribution` the product's probability is averaged
    over the variable that is relatively the narrower one.

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
    lower, centre, upper = (np.asarray(family.ppf(p, *parameters)) for p in (0.25, 0.5, 0.75))
    narrow = usable & (relative_sd * np.abs(centre) <= 2.0 * (upper - lower))
    positive = _factor(factor, relative_sd)
    reach = np.hypot((plain - centre) * factor, relative_sd * factor * centre * stats.norm.ppf(q))
    start = centre * factor + np.sign(q - 0.5) * reach
    factors = np.where(_LOGITS > 0.0, positive.isf(_PROBABILITIES[::-1]), positive.ppf(_PROBABILITIES))
    for rows, by_factor in ((narrow, True), (usable & ~narrow, False)):
        if not rows.any():
            continue
        chosen = family(*(a[rows, None] for a in parameters))
        if by_factor:
            nodes, outer = factors[None, :], chosen
        else:
            upper_half, lower_half = chosen.isf(_PROBABILITIES[::-1]), chosen.ppf(_PROBABILITIES)
            nodes, outer = np.where(_LOGITS > 0.0, upper_half, lower_half), positive
        result[rows] = _invert(nodes, outer.cdf, outer.pdf, start[rows], reach[rows], q)
    return result


def _factor(factor: float, relative_sd: float) -> stats.distributions.rv_frozen:
    return stats.truncnorm(-1.0 / relative_sd, np.inf, loc=factor, scale=factor * relative_sd)


def _invert(
    nodes: Array,
    cdf: Callable[[Array], Array],
    pdf: Callable[[Array], Array],
    start: Array,
    reach: Array,
    q: float,
) -> Array:
    """Newton's method kept inside a bracket, for all rows at once."""
    x, low, high = start, start - 50.0 * reach, start + 50.0 * reach
    for _ in range(_ITERATIONS):
        z = x[:, None] / nodes
        below = cdf(z)
        excess = np.where(nodes > 0.0, below, 1.0 - below) @ _WEIGHTS - q
        density = (pdf(z) / np.abs(nodes)) @ _WEIGHTS
        low, high = np.where(excess < 0.0, x, low), np.where(excess < 0.0, high, x)
        newton = x - np.divide(excess, density, out=np.full_like(x, np.inf), where=density > 0.0)
        following = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        done = np.all(np.abs(following - x) <= 1e-13 * reach)
        x = following
        if done:
            break
    return x
