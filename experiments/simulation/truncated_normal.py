"""Truncated normal distributions: the probability of an interval, and draws from within a box."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from friction_bayes.core.arrays import Array
from friction_bayes.loop.infer.normal_above import draws_in_turn

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
    """Draws from a normal cut to a box, shape (draws, k)."""

    def cut(i: int, centre: Array, width: float) -> tuple[Array, Array]:
        a, b = (low[i] - centre) / width, (high[i] - centre) / width
        return interval_quantile(a, b, 1.0 - rng.random(draws)), log_interval_probability(a, b)

    room = np.minimum(mean - low, high - mean)
    return np.clip(draws_in_turn(mean, covariance, room, cut, rng, draws), low, high)
