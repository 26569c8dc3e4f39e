"""The only log-likelihoods, shared by the closed forms and the sampler.

Each is a function of sufficient statistics, so that one evaluation costs the same whatever the length of
the record, and broadcasts over the parameters, so that all walkers of an ensemble go in one call. The
``pointwise`` forms are the same likelihoods datum by datum; their sums equal the O(1) forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.conjugate.sufficient_statistics import NormalStatistics, RegressionStatistics
from friction_bayes.core.arrays import Array

__all__ = [
    "Target",
    "exponential_log_likelihood",
    "exponential_pointwise",
    "normal_log_likelihood",
    "normal_pointwise",
    "regression_log_likelihood",
    "regression_pointwise",
    "signal_log_likelihood",
]

_LOG_2PI = math.log(2.0 * math.pi)


def normal_log_likelihood(mean: ArrayLike, precision: ArrayLike, data: NormalStatistics) -> Array:
    """Log-likelihood of independent normal samples.

    Parameters
    ----------
    mean, precision : array_like, broadcast together
        Mean and precision (inverse variance) of a sample.
    data : NormalStatistics
        The samples.

    Returns
    -------
    ndarray
        ``n/2 log(s/2 pi) - s/2 (ss + n (xbar - mean)**2)``.
    """
    s = np.asarray(precision, dtype=np.float64)
    spread = data.sum_of_squares + data.n * (data.mean - np.asarray(mean, dtype=np.float64)) ** 2
    return 0.5 * data.n * (np.log(s) - _LOG_2PI) - 0.5 * s * spread


def normal_pointwise(mean: Array, precision: Array, samples: Array) -> Array:
    """Log-likelihood of each of ``n`` normal samples, shape (draws, n)."""
    s = precision[:, None]
    return 0.5 * (np.log(s) - _LOG_2PI) - 0.5 * s * (samples[None, :] - mean[:, None]) ** 2


def exponential_log_likelihood(rate: ArrayLike, *, n: int, total: float) -> Array:
    """Formal log-likelihood of ``n`` samples of an exponential of the given rate, ``n log r - r total``.

    Formal, because it looks at the samples only through their sum: a negative sample, where an exponential
    density is zero, goes in like any other. The paper's Eq. (11) does so without saying it.
    """
    r = np.asarray(rate, dtype=np.float64)
    return n * np.log(r) - r * total


def exponential_pointwise(rate: Array, samples: Array) -> Array:
    """Formal exponential log-likelihood of each sample, shape (draws, n)."""
    return np.log(rate)[:, None] - rate[:, None] * samples[None, :]


def regression_log_likelihood(
    coefficients: ArrayLike, variance: ArrayLike, data: RegressionStatistics
) -> Array:
    """Log-likelihood of a linear regression with independent normal errors.

    Parameters
    ----------
    coefficients : array_like, shape (..., p)
        Regression coefficients.
    variance : array_like, shape (...)
        Variance of an error.
    data : RegressionStatistics
        Design and response, reduced.

    Returns
    -------
    ndarray, shape (...)
        ``-n/2 log(2 pi v) - (rss + |Q'y - R b|**2) / (2 v)``.
    """
    v = np.asarray(variance, dtype=np.float64)
    misfit = data.projected - np.asarray(coefficients, dtype=np.float64) @ data.r.T
    return -0.5 * data.n * (np.log(v) + _LOG_2PI) - 0.5 * (data.residual_sum + (misfit**2).sum(axis=-1)) / v


def regression_pointwise(coefficients: Array, variance: Array, design: Array, response: Array) -> Array:
    """Log-likelihood of each response, shape (draws, n)."""
    v = variance[:, None]
    return -0.5 * (np.log(v) + _LOG_2PI) - 0.5 * (response[None, :] - coefficients @ design.T) ** 2 / v


def signal_log_likelihood(misfit: Array, log_variance: Array, n: int) -> Array:
    """Log-likelihood of ``n`` samples with independent normal errors, from their squared residuals."""
    return -0.5 * n * (_LOG_2PI + log_variance) - 0.5 * misfit * np.exp(-log_variance)


@dataclass(frozen=True, kw_only=True)
class Target:
    """A posterior as the sampler sees it, in unconstrained coordinates, next to its closed form.

    Attributes
    ----------
    names : tuple of str
        Names of the sampled coordinates, length ``d``; transformed ones say so (``log_precision``).
    log_prob : callable, (walkers, d) -> (walkers,)
        Log-likelihood plus log-prior plus log-Jacobian of the transform, vectorised over walkers.
    closed_form : callable, (walkers, d) -> (walkers,)
        Log-density of the closed-form posterior in the same coordinates; ``log_prob`` minus this is one
        constant over parameter space where the closed form is exact.
    centre : ndarray, shape (d,)
        Closed-form location, where the ensembles start.
    covariance : ndarray, shape (d, d)
        Closed-form covariance in the same coordinates; ensembles start over-dispersed by a stated factor.
    posterior : callable, (draws, d) -> dict of str to (draws, ...) arrays
        Natural parameters: always ``friction`` [force unit]; ``precision``, ... where the model has them.
    log_prior : callable, (walkers, d) -> (walkers,)
        Log-prior plus log-Jacobian alone: ``log_prob`` with an empty data set.
    pointwise : callable, (draws, d) -> (draws, blocks)
        Log-likelihood per honest unit of data: a friction sample, an amplitude, a half cycle of signal.
    predictive : callable, (draws, d), Generator -> (draws, n)
        Replicated data, same shape as ``observed``.
    prior_draws : callable, Generator, int -> (draws, d)
        Draws from the prior, in the sampler's coordinates; proper priors only.
    observed : ndarray, shape (n,)
        The data of the likelihood.
    observed_name : str
        Its name in ``observed_data``.
    humps : tuple of (ndarray (d,), ndarray (d, d))
        Location and covariance of each mode of the closed form, where it has several that lie apart: a
        sampler has to propose the way from one to another. Empty where it has one.
    """

    names: tuple[str, ...]
    log_prob: Callable[[Array], Array]
    closed_form: Callable[[Array], Array]
    centre: Array
    covariance: Array
    posterior: Callable[[Array], dict[str, Array]]
    log_prior: Callable[[Array], Array]
    pointwise: Callable[[Array], Array]
    predictive: Callable[[Array, np.random.Generator], Array]
    prior_draws: Callable[[np.random.Generator, int], Array]
    observed: Array
    observed_name: str
    humps: tuple[tuple[Array, Array], ...] = ()
