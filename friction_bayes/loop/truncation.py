"""Normal distributions cut to a box: how much of one lies inside, and draws from what does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import log_ndtr, ndtri_exp

__all__ = ["log_box_probability", "log_interval_probability", "truncated_draws"]

Array = NDArray[np.float64]

_FAR = 6.0
"""Standard deviations from an end beyond which it does not count."""
_INTEGRATION_ERROR = 1e-6
_LEAST_INTEGRATED = 1e-4


def log_interval_probability(low: Array, high: Array) -> Array:
    """Log-probability that a standard normal lies between, however far out.

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
    """Log-probability that a multivariate normal lies in a box.

    By Genz's integration over the coordinates near an end; where that is too small to be integrated,
    coordinate after coordinate, each given the truncated mean and variance of those before it
    (Mendell & Elston, Biometrics 30, 1974), which is exact for independent coordinates alone.

    Parameters
    ----------
    mean, low, high : ndarray, shape (k,)
    covariance : ndarray, shape (k, k)
    """
    sd = np.sqrt(np.diag(covariance))
    scores = (low - mean) / sd, (high - mean) / sd
    near = np.flatnonzero((scores[0] > -_FAR) | (scores[1] < _FAR))
    if near.size == 0:
        return 0.0
    if near.size == 1:
        return float(log_interval_probability(scores[0][near], scores[1][near])[0])
    block = covariance[np.ix_(near, near)]
    correlation = block / np.outer(sd[near], sd[near])
    mass = float(
        stats.multivariate_normal.cdf(
            scores[1][near],
            cov=correlation,
            lower_limit=scores[0][near],
            allow_singular=True,
            abseps=_INTEGRATION_ERROR,
            rng=np.random.default_rng(0),
        )
    )
    if mass > _LEAST_INTEGRATED:
        return min(math.log(mass), 0.0)
    return _coordinate_by_coordinate(mean[near], block, low[near], high[near])


def _coordinate_by_coordinate(mean: Array, covariance: Array, low: Array, high: Array) -> float:
    mean, block = mean.copy(), covariance.copy()
    left = list(range(mean.size))
    total = 0.0
    while left:
        sd = np.sqrt(np.diag(block)[left])
        scores = (low[left] - mean[left]) / sd, (high[left] - mean[left]) / sd
        mass = log_interval_probability(*scores)
        at = int(np.argmin(mass))
        i = left.pop(at)
        total += float(mass[at])
        shift, shrink = _moments(float(scores[0][at]), float(scores[1][at]), float(mass[at]))
        gain = block[:, i] / block[i, i]
        mean = mean + gain * shift * sd[at]
        block = block - np.outer(gain, gain) * block[i, i] * (1.0 - shrink)
    return total


def _moments(low: float, high: float, log_mass: float) -> tuple[float, float]:
    """Mean and variance of a standard normal cut to an interval."""
    density = [
        math.exp(min(-0.5 * x * x - 0.5 * math.log(2.0 * math.pi) - log_mass, 700.0))
        if math.isfinite(x)
        else 0.0
        for x in (low, high)
    ]
    mean = density[0] - density[1]
    edges = sum(
        sign * x * f for sign, x, f in zip((1.0, -1.0), (low, high), density, strict=True) if math.isfinite(x)
    )
    # far out the variance is a small difference of large numbers
    return mean, min(max(1.0 + edges - mean * mean, 1e-6), 1.0)


def truncated_draws(
    mean: Array, covariance: Array, low: Array, high: Array, rng: np.random.Generator, draws: int
) -> Array:
    """Draw from a normal cut to a box, shape (draws, k).

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
        # in the tail where both are far from zero
        flip = a + b > 0.0
        near, far = np.where(flip, -a, b), np.where(flip, -b, a)
        u = 1.0 - rng.random(draws)
        log_near = log_ndtr(near)
        share = u + (1.0 - u) * np.exp(log_ndtr(far) - log_near)
        drawn = np.clip(ndtri_exp(log_near + np.log(share)), far, near)
        normal[:, k] = np.where(flip, -drawn, drawn)
        if k:
            log_weight += log_interval_probability(a, b)
    out = np.empty_like(normal)
    out[:, order] = mean[order] + normal @ root.T
    out = np.clip(out, low, high)
    if np.ptp(log_weight) < 1e-9:
        return out
    weight = np.exp(log_weight - log_weight.max())
    return np.asarray(out[rng.choice(draws, draws, p=weight / weight.sum())])
