"""The probability that a multivariate normal lies in a box."""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from experiments.simulation.truncated_normal import interval_quantile, log_interval_probability
from friction_bayes.core.arrays import Array

__all__ = ["log_box_probability"]

_INSIDE = 1e-9
"""Log-probability of missing an end below which the end does not count."""
_MOST_JOINT = 6
_NODES = {1: 1, 2: 48, 3: 24, 4: 14, 5: 9, 6: 6}
"""Nodes a coordinate, by the number of coordinates."""


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
            drawn = interval_quantile(ends[0][:, None], ends[1][:, None], ranks)
            scores = np.column_stack([np.repeat(scores, ranks.size, axis=0), drawn.ravel()])
            log_mass = (log_mass[:, None] + log_weights).ravel()
    return float(logsumexp(log_mass)) + float(alone[rest].sum())
