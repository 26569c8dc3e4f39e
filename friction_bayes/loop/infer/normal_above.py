"""Draws from a normal distribution that is cut from below."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from friction_bayes.core.arrays import Array

__all__ = ["draws_above"]


def draws_above(low: Array, mean: Array, covariance: Array, rng: np.random.Generator, draws: int) -> Array:
    """Draws from a normal given that no coordinate lies below its least value, shape (draws, k).

    Coordinates are drawn in turn, each from its conditional normal where it is cut, and then drawn again in
    proportion to the probability that this left the later ones; with one that is cut that is exact, with more
    it becomes so with the number of draws.
    """
    scale = np.sqrt(np.diag(covariance))
    order = np.argsort((mean - low) / scale, kind="stable")
    block = covariance[np.ix_(order, order)]
    width = scale[order]
    root = np.linalg.cholesky(block / np.outer(width, width) + 1e-13 * np.eye(width.size)) * width[:, None]
    normal = rng.standard_normal((draws, mean.size))
    log_weight = np.zeros(draws)
    for k, i in enumerate(order):
        if not math.isfinite(low[i]):
            continue
        centre = mean[i] + normal[:, :k] @ root[k, :k]
        least = (low[i] - centre) / root[k, k]
        log_above = log_ndtr(-least)
        rank = 1.0 - rng.random(draws)
        # counted from the top, however far out that is
        normal[:, k] = -np.minimum(ndtri_exp(log_above + np.log(1.0 - rank)), -least)
        if k:
            log_weight += log_above
    out = np.empty_like(normal)
    out[:, order] = mean[order] + normal @ root.T
    out = np.maximum(out, low)
    if np.ptp(log_weight) < 1e-9:
        return out
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(out[rng.choice(draws, draws, p=weight / weight.sum())])
