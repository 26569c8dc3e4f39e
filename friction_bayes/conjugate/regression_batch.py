"""Many regressions under one prior at once, equal to :class:`NormalInverseGamma` updates up to rounding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.conjugate.regression import NormalInverseGamma, mean_error_sd
from friction_bayes.core.arrays import Array, Integers, Mask

__all__ = ["RegressionPosteriors", "update_regressions"]


@dataclass(frozen=True, eq=False)
class RegressionPosteriors:
    """Student t marginals of the coefficients of many posteriors; nan where there is none.

    Attributes
    ----------
    mean, scale : ndarray, shape (records, p)
        Location and scale of the coefficients.
    degrees : ndarray, shape (records,)
        Degrees of freedom.
    noise_sd : ndarray, shape (records,)
        Posterior mean standard deviation of an error.
    """

    mean: Array
    scale: Array
    degrees: Array
    noise_sd: Array


def update_regressions(
    prior: NormalInverseGamma,
    factor: Array,
    projected: Array,
    residual_sum: Array,
    counts: Integers,
    found: Mask,
) -> RegressionPosteriors:
    """Update one prior with the data of many records; the algorithm of a single update, row by row.

    Parameters
    ----------
    prior : NormalInverseGamma
    factor : ndarray, shape (records, p, p)
        ``R`` of every record's data, see :class:`friction_bayes.conjugate.likelihood.RegressionStatistics`.
    projected : ndarray, shape (records, p)
        Their ``Q'y``.
    residual_sum : ndarray, shape (records,)
        Residual sums of squares.
    counts : ndarray of int, shape (records,)
        Responses.
    found : ndarray of bool, shape (records,)
        Which records have such data; the others may hold anything finite, with a regular factor.
    """
    stacked = np.concatenate([np.broadcast_to(prior.factor, factor.shape), factor], axis=1)
    response = projected - np.einsum("rij,j->ri", factor, prior.mean)
    misfit = np.concatenate([np.zeros_like(response), response], axis=1)
    scale = np.linalg.norm(stacked, axis=1)
    scaled = stacked / scale[:, None, :]
    q, r = np.linalg.qr(scaled)
    solution = np.linalg.solve(r, q.swapaxes(-1, -2) @ misfit[..., None])[..., 0]
    residual = misfit - np.einsum("rij,rj->ri", scaled, solution)
    alpha = prior.alpha + 0.5 * counts
    beta = prior.beta + 0.5 * (residual_sum + (residual**2).sum(axis=1))
    usable = found & (alpha > 0.5) & (beta > 0.0)
    alpha, beta = np.where(usable, alpha, 1.0), np.where(usable, beta, 1.0)
    inverse = np.linalg.inv(r) / scale[:, :, None]
    spread = np.sqrt((inverse**2).sum(axis=2) * (beta / alpha)[:, None])

    def where_usable(values: NDArray[Any]) -> Array:
        return np.where(usable.reshape(-1, *[1] * (values.ndim - 1)), values, np.nan)

    return RegressionPosteriors(
        mean=where_usable(prior.mean + solution / scale),
        scale=where_usable(spread),
        degrees=where_usable(2.0 * alpha),
        noise_sd=where_usable(mean_error_sd(alpha, beta)),
    )
