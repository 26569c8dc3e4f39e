"""Truncated normal distributions: the probability of an interval, and draws from within a box."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from friction_bayes.core.arrays import Array

__all__ = ["interval_quantile", "log_interval_probability", "truncated_draws"]


def log_interval_probability(low: Array, high: Array) -> Array:
    """Log-probability that a standard normal lies between scores, which may be infinite, however far out."""
    # by symmetry on the side where both ends are far below zero
    flip = high > -low
    near = np.where(flip, -low, high)
    far = np.where(flip, -high, low)
    upper = log_ndtr(near)
    ratio = np.exp(np.minimum(log_ndtr(far) - upper, 0.0))
    return np.asarray(upper + np.log1p(-np.minimum(ratio, 1.0 - 1e-15)))


def interval_quantile(low: Array, high: Array, rank: Array) -> Array:
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
        normal[:, k] = interval_quantile(a, b, 1.0 - rng.random(draws))
        if k:
            log_weight += log_interval_probability(a, b)
    out = np.empty_like(normal)
    out[:, order] = mean[order] + normal @ root.T
    out = np.clip(out, low, high)
    if np.ptp(log_weight) < 1e-9:
        return out
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(out[rng.choice(draws, draws, p=weight / weight.sum())])
