"""Draws from a normal distribution that is cut from below."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from friction_bayes.core.arrays import Array

__all__ = ["draws_above", "draws_in_turn"]


def draws_above(low: Array, mean: Array, covariance: Array, rng: np.random.Generator, draws: int) -> Array:
    """Draws from a normal given that no coordinate lies below its least value, shape (draws, k)."""

    def cut(i: int, centre: Array, width: float) -> tuple[Array, Array]:
        least = (low[i] - centre) / width
        log_above = log_ndtr(-least)
        rank = 1.0 - rng.random(draws)
        # counted from the top, however far out that is
        return -np.minimum(ndtri_exp(log_above + np.log(1.0 - rank)), -least), log_above

    return np.maximum(draws_in_turn(mean, covariance, mean - low, cut, rng, draws), low)


def draws_in_turn(
    mean: Array,
    covariance: Array,
    room: Array,
    cut: Callable[[int, Array, float], tuple[Array, Array]],
    rng: np.random.Generator,
    draws: int,
) -> Array:
    """Draws from a normal whose coordinates are cut, shape (draws, k).

    Coordinates are drawn in turn, each from its conditional normal where it is cut, and then drawn again in
    proportion to the probability that this left the later ones; with one that is cut that is exact, with more
    it becomes so with the number of draws.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (k,), (k, k)
    room : ndarray, shape (k,)
        How far from the mean each is cut, infinite where it is not: those with the least come first.
    cut : callable, (i, centre, width) -> (scores, log_probability), each of shape (draws,)
        Draws of coordinate ``i`` in standard deviations from the conditional mean, and the probability left.
    rng : numpy.random.Generator
    draws : int
    """
    scale = np.sqrt(np.diag(covariance))
    order = np.argsort(room / scale, kind="stable")
    block = covariance[np.ix_(order, order)]
    width = scale[order]
    root = np.linalg.cholesky(block / np.outer(width, width) + 1e-13 * np.eye(width.size)) * width[:, None]
    normal = rng.standard_normal((draws, mean.size))
    log_weight = np.zeros(draws)
    for k, i in enumerate(order.tolist()):
        if not math.isfinite(room[i]):
            continue
        normal[:, k], log_left = cut(i, mean[i] + normal[:, :k] @ root[k, :k], root[k, k])
        if k:
            log_weight += log_left
    out = np.empty_like(normal)
    out[:, order] = mean[order] + normal @ root.T
    if np.ptp(log_weight) < 1e-9:
        return out
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(out[rng.choice(draws, draws, p=weight / weight.sum())])
