"""Truncated normal distributions: the probability of a box, and draws from within it."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri_exp

from friction_bayes.core.arrays import Array

__all__ = ["log_box_probability", "log_interval_probability", "truncated_draws"]


_INSIDE = 1e-9
"""Log-probability of missing an end below which the end does not count."""
_MOST_JOINT = 6
_NODES = {1: 1, 2: 48, 3: 24, 4: 14, 5: 9, 6: 6}
"""Nodes a coordinate, by the number of coordinates."""


def log_interval_probability(low: Array, high: Array) -> Array:
    """Log-probability that a standard normal lies in an interval, however far out.

    Parameters
    ----------
    low, high : ndarray, same shape
        Scores; may be infinite.
    """
    # by symmetry on the side where both ends are far below zero
    flip = high > -low
    near = np.where(flip, -low, high)
    far = np.where(flip, -high, low)
    upper = log_ndtr(near)
    ratio = np.exp(np.minimum(log_ndtr(far) - upper, 0.0))
    return np.asarray(upper + np.log1p(-np.minimum(ratio, 1.0 - 1e-15)))


def log_box_probability(mean: Array, covariance: Array, low: Array, high: Array) -> float:
    """Log-probability that a multivariate normal lies in a box, however far out.

    Genz's transformation (J. Comput. Graph. Stat. 1, 1992): coordinate after coordinate, the least probable
    first, each conditional on those before it; a product of Gauss and Legendre's rules over their ranks.
    Coordinates far inside are left out; of more than six the others count as independent.

    Parameters
    ----------
    mean, low, high : ndarray, shape (k,)
    covariance : ndarray, shape (k, k)
    """
    sd = np.sqrt(np.diag(covariance))
    alone = log_interval_probability((low - mean) / sd, (high - mean) / sd)
    order = np.argsort(alone, kind="stable")
    order = order[alone[order] < -_INSIDE]
    if order.size == 0:
        return 0.0
    joint, rest = order[:_MOST_JOINT], order[_MOST_JOINT:]
    scale = sd[joint]
    correlation = covariance[np.ix_(joint, joint)] / np.outer(scale, scale)
    root = np.linalg.cholesky(correlation + 1e-12 * np.eye(joint.size))
    a, b = (low[joint] - mean[joint]) / scale, (high[joint] - mean[joint]) / scale
    ranks, weights = np.polynomial.legendre.leggauss(_NODES[joint.size])
    ranks, log_weights = 0.5 + 0.5 * ranks, np.log(0.5 * weights)
    scores = np.empty((1, 0))
    log_mass = np.zeros(1)
    for i in range(joint.size):
        centre = scores @ root[i, :i]
        ends = (a[i] - centre) / root[i, i], (b[i] - centre) / root[i, i]
        log_mass = log_mass + log_interval_probability(*ends)
        if i + 1 < joint.size:
            drawn = _interval_quantile(ends[0][:, None], ends[1][:, None], ranks)
            scores = np.column_stack([np.repeat(scores, ranks.size, axis=0), drawn.ravel()])
            log_mass = (log_mass[:, None] + log_weights).ravel()
    return float(logsumexp(log_mass)) + float(alone[rest].sum())


def _interval_quantile(low: Array, high: Array, rank: Array) -> Array:
    """Quantile of a standard normal cut to an interval, however far out."""
    flip = high > -low
    near, far = np.where(flip, -low, high), np.where(flip, -high, low)
    # counted from the end that lies nearer to the middle
    u = np.where(flip, rank, 1.0 - rank)
    log_near = log_ndtr(near)
    share = (1.0 - u) + u * np.exp(log_ndtr(far) - log_near)
    drawn = np.clip(ndtri_exp(log_near + np.log(share)), far, near)
    return np.asarray(np.where(flip, -drawn, drawn))


def truncated_draws(
    mean: Array, covariance: Array, low: Array, high: Array, rng: np.random.Generator, draws: int
) -> Array:
    """Draws from a normal cut to a box, shape (draws, k).

    Coordinates are drawn in turn, each from its conditional normal cut to its interval, and then drawn
    again in proportion to the probability that this left the later ones; with one bounded coordinate that
    is exact, with more it becomes so with the number of draws.
    """
    scale = np.sqrt(np.diag(covariance))
    sure = np.minimum(mean - low, high - mean) / scale
    order = np.argsort(sure, kind="stable")
    block = covariance[np.ix_(order, order)]
    width = scale[order]
    root = np.linalg.cholesky(block / np.outer(width, width) + 1e-13 * np.eye(width.size)) * width[:, None]
    normal = rng.standard_normal((draws, mean.size))
    log_weight = np.zeros(draws)
    for k, i in enumerate(order):
        if not math.isfinite(low[i]) and not math.isfinite(high[i]):
            continue
        centre = mean[i] + normal[:, :k] @ root[k, :k]
        a, b = (low[i] - centre) / root[k, k], (high[i] - centre) / root[k, k]
        normal[:, k] = _interval_quantile(a, b, 1.0 - rng.random(draws))
        if k:
            log_weight += log_interval_probability(a, b)
    out = np.empty_like(normal)
    out[:, order] = mean[order] + normal @ root.T
    out = np.clip(out, low, high)
    if np.ptp(log_weight) < 1e-9:
        return out
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(out[rng.choice(draws, draws, p=weight / weight.sum())])
