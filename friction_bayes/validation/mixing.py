"""How precise a mean of correlated draws is: integrated autocorrelation time, effective sample size.

Walkers of one emcee ensemble move by looking at each other, so they are not independent chains. What is
independent is one ensemble and another; and what estimates an expectation is the mean over the walkers of
an ensemble, a scalar series in time. The variance of the mean of *that* series, cross-correlations of
walkers included, against the variance of a single draw is the effective sample size (Goodman & Weare 2010,
section 3).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri
from scipy.stats import rankdata

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = ["Mixing", "as_ensembles", "bulk_ess", "mixing", "rank_normalise", "tail_ess"]


_WINDOW = 5.0
"""Sokal's window: autocorrelations are summed up to the first lag beyond this many times their sum."""


class Mixing(NamedTuple):
    """How well the mean of one function over the draws is known.

    Attributes
    ----------
    ess : float
        Effective sample size: variance of a draw over variance of the mean. Zero where nothing moved.
    tau : float
        Integrated autocorrelation time in steps: draws over ``ess``.
    dof : float
        Degrees of freedom of the estimated variance of the mean; a difference over its
        Monte Carlo standard error is compared with a Student t of as many.
    """

    ess: float
    tau: float
    dof: float


def as_ensembles(draws: ArrayLike) -> Array:
    """Return draws as (ensembles, walkers, steps): one chain (n,), or independent chains (chains, n), too."""
    values = np.asarray(draws, dtype=np.float64)
    if values.ndim == 1:
        return values[None, None, :]
    if values.ndim == 2:
        return values[:, None, :]
    if values.ndim == 3:
        return values
    raise InputError("draws", f"shape {values.shape}", "give (n,), (chains, n) or (ensembles, walkers, n)")


def mixing(draws: ArrayLike) -> Mixing:
    """Effective sample size of the mean of ``draws``.

    Parameters
    ----------
    draws : array_like, shape (n,), (chains, n) or (ensembles, walkers, n)
        Values of the function of interest; ensembles (chains) are independent of each other, walkers are not.

    Returns
    -------
    Mixing

    Notes
    -----
    Autocorrelations are pooled over ensembles about the *grand* mean, so that ensembles that have not found
    each other show as slow mixing. The variance of the windowed sum follows Sokal: relative variance
    ``2 (2 M + 1) / n`` for a window of ``M`` lags in ``n`` steps in all; taking the mean from the same series
    costs ``(2 M + 1) / n`` of it, which is given back.
    """
    values = as_ensembles(draws)
    ensembles, _, steps = values.shape
    spread = float(values.var())
    if spread == 0.0:
        return Mixing(0.0, np.inf, 1.0)
    series = values.mean(axis=1) - values.mean()
    size = 1 << (2 * steps - 1).bit_length()
    spectrum = np.fft.rfft(series, size)
    covariance = np.fft.irfft((spectrum * spectrum.conj()).real, size)[:, :steps].mean(axis=0) / steps
    if covariance[0] == 0.0:
        return Mixing(0.0, np.inf, 1.0)
    sums = 2.0 * np.cumsum(covariance) / covariance[0] - 1.0
    outside = np.flatnonzero(np.arange(steps) >= _WINDOW * sums)
    window = int(outside[0]) if outside.size else steps - 1
    # an anticorrelated series may mix better than independent draws; do not claim more than 2 per draw
    time = max(float(sums[window]), 0.5)
    total = ensembles * steps
    dof = max(total / (2.0 * window + 1.0), 2.0)
    variance_of_mean = float(covariance[0]) * time / total / (1.0 - 1.0 / dof)
    ess = min(spread / variance_of_mean, 2.0 * values.size)
    return Mixing(ess, values.size / ess, dof)


def rank_normalise(draws: Array) -> Array:
    """Replace draws by normal scores of their pooled ranks (Vehtari et al. 2021, Eq. 14), same shape."""
    ranks = rankdata(draws, method="average").reshape(draws.shape)
    return np.asarray(ndtri((ranks - 0.375) / (draws.size + 0.25)))


def bulk_ess(draws: ArrayLike) -> Mixing:
    """Effective sample size of the rank-normalised draws; shapes as in :func:`mixing`."""
    return mixing(rank_normalise(as_ensembles(draws)))


def tail_ess(draws: ArrayLike) -> Mixing:
    """Effective sample size of the worse of the 5 % and 95 % tail indicators; shapes as in :func:`mixing`."""
    values = as_ensembles(draws)
    tails = np.quantile(values, (0.05, 0.95))
    return min((mixing(values <= tail) for tail in tails), key=lambda tail: tail.ess)
