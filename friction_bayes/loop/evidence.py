r"""Laplace's approximation to the evidence, the noise scale integrated and the prior cut to its support.

With the mode :math:`\hat z`, deviance :math:`D` at the best noise scale and precision :math:`H` of the ``p``
coordinates,

.. math:: \log E = -\tfrac12 D + \log\pi(\hat z) + \tfrac p2 \log 2\pi - \tfrac12\log|H| + \log P(z\in S),

where the last term is the posterior probability of the support under the normal approximation: fits go
through the null of a force into values the prior excludes, and pay for it here. The scale-invariant prior of
the noise scale is improper but the same, on the same samples, for every model that is compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import ndtr, ndtri

from friction_bayes.errors import InputError
from friction_bayes.loop.fit import LoopFit

__all__ = ["bounded_draws", "log_evidence", "posterior_probabilities"]

Array = NDArray[np.float64]

_FAR = 6.0
"""Standard deviations from a bound beyond which it does not count."""
_LEAST = 1e-12


def log_evidence(fit: LoopFit) -> float:
    """Log-evidence of a fit, up to what all models of the same samples share."""
    least = np.array([c.least_precision for c in fit.model.coordinates])
    root = np.linalg.cholesky(fit.precision + np.diag(least))
    value = -0.5 * fit.objective + math.fsum(c.log_normalisation for c in fit.model.coordinates)
    value += 0.5 * fit.z.size * math.log(2.0 * math.pi) - float(np.log(np.diag(root)).sum())
    value += math.fsum(noise.log_volume for noise in fit.noises)
    return value + _log_support(fit)


def posterior_probabilities(fits: Sequence[LoopFit], log_priors: Array, evidences: Array) -> Array:
    """Posterior probabilities of models.

    Raises
    ------
    InputError
        If the models were not fitted to the same samples.
    """
    first = fits[0].model.segments
    for fit in fits[1:]:
        same = len(fit.model.segments) == len(first) and all(
            a.values is b.values or np.array_equal(a.values, b.values)
            for a, b in zip(fit.model.segments, first, strict=True)
        )
        if not same:
            raise InputError(
                "candidates", "were fitted to different samples", "compare evidences on the same data alone"
            )
    score = evidences + log_priors
    weight = np.exp(score - score.max())
    return np.asarray(weight / weight.sum())


def _near_bounds(fit: LoopFit) -> tuple[list[int], Array, Array, Array]:
    covariance = fit.covariance
    sd = np.sqrt(np.diag(covariance))
    support = np.array([c.support for c in fit.model.coordinates])
    low, high = support[:, 0], support[:, 1]
    near = np.flatnonzero((fit.z - low < _FAR * sd) | (high - fit.z < _FAR * sd))
    return [int(i) for i in near], low, high, covariance


def _log_support(fit: LoopFit) -> float:
    near, low, high, covariance = _near_bounds(fit)
    if not near:
        return 0.0
    if len(near) == 1:
        i = near[0]
        sd = math.sqrt(covariance[i, i])
        mass = float(ndtr((high[i] - fit.z[i]) / sd) - ndtr((low[i] - fit.z[i]) / sd))
        return math.log(max(mass, 1e-300))
    # in units of their standard deviations, however different the coordinates' scales
    widths = np.sqrt(np.diag(covariance))[near]
    block = covariance[np.ix_(near, near)] / np.outer(widths, widths)
    joint = float(
        stats.multivariate_normal.cdf(
            (high[near] - fit.z[near]) / widths,
            cov=block,
            lower_limit=(low[near] - fit.z[near]) / widths,
            allow_singular=True,
            rng=np.random.default_rng(0),
        )
    )
    return math.log(max(joint, _LEAST))


def bounded_draws(fit: LoopFit, rng: np.random.Generator, draws: int) -> Array:
    """Draw coordinates from the normal approximation cut to the support, shape (draws, p).

    Coordinates near a bound come first, each from its conditional normal cut to its support; with one such
    coordinate that is exact.
    """
    near, low, high, covariance = _near_bounds(fit)
    order = near + [i for i in range(fit.z.size) if i not in near]
    block = covariance[np.ix_(order, order)]
    scale = np.sqrt(np.diag(block))
    root = np.linalg.cholesky(block / np.outer(scale, scale) + 1e-13 * np.eye(scale.size)) * scale[:, None]
    normal = rng.standard_normal((draws, fit.z.size))
    for k, i in enumerate(near):
        centre = fit.z[i] + normal[:, :k] @ root[k, :k]
        a, b = ndtr((low[i] - centre) / root[k, k]), ndtr((high[i] - centre) / root[k, k])
        u = a + (b - a) * rng.random(draws)
        normal[:, k] = ndtri(np.clip(u, 1e-16, 1.0 - 1e-16))
    out = np.empty_like(normal)
    out[:, order] = fit.z[order] + normal @ root.T
    for i in near:
        out[:, i] = np.clip(out[:, i], low[i], high[i])
    return out
