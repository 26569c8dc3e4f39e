"""Posterior summaries of many whole-signal fits at once, equal to those of one record up to rounding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from friction_bayes.conjugate.waveform_fits import FLAT, WaveformFits
from friction_bayes.conjugate.waveform_sums import COEFFICIENTS

__all__ = ["WaveformSummaries", "summarise_fits"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WaveformSummaries:
    """Student t marginals of many posteriors, every array of shape (records,); nan where none was found.

    Attributes
    ----------
    friction, friction_scale : ndarray
        Location and scale of the friction coefficient.
    frequency, frequency_scale : ndarray
        Phase advance over half the moving part [rad].
    rest_position : ndarray
        Unit of the signal.
    degrees : ndarray
        Degrees of freedom.
    noise_sd : ndarray
        Posterior mean standard deviation of a sample.
    """

    friction: Array
    friction_scale: Array
    frequency: Array
    frequency_scale: Array
    rest_position: Array
    degrees: Array
    noise_sd: Array


def summarise_fits(
    fits: WaveformFits, counts: NDArray[np.int64], prior: Mapping[str, float]
) -> WaveformSummaries:
    """Update the prior with every fit; see :meth:`NormalInverseGamma.update_statistics` for the algorithm.

    Parameters
    ----------
    fits : WaveformFits
        From :func:`fit_waveforms`, rest positions free.
    counts : ndarray of int, shape (records,)
        Samples in each moving part.
    prior : mapping
        ``coefficient_precision``, ``alpha`` and ``beta``.
    """
    found = fits.found
    normal = np.where(found[:, None, None], fits.normal, np.eye(COEFFICIENTS))
    coefficients = np.where(found[:, None], fits.coefficients, 0.0)
    factor = np.linalg.cholesky(normal).swapaxes(-1, -2)
    step = np.linalg.solve(factor.swapaxes(-1, -2), np.where(found[:, None], fits.gradient, 0.0)[..., None])[
        ..., 0
    ]
    response = np.einsum("rij,rj->ri", factor, coefficients) + step
    root = np.full(COEFFICIENTS, np.sqrt(prior["coefficient_precision"]))
    root[-FLAT:] = 0.0
    stacked = np.concatenate([np.broadcast_to(np.diag(root), factor.shape), factor], axis=1)
    misfit = np.concatenate([np.zeros_like(response), response], axis=1)
    scale = np.linalg.norm(stacked, axis=1)
    q, r = np.linalg.qr(stacked / scale[:, None, :])
    solution = np.linalg.solve(r, (q.swapaxes(-1, -2) @ misfit[..., None]))[..., 0]
    residual = misfit - np.einsum("rij,rj->ri", stacked / scale[:, None, :], solution)
    mean = solution / scale
    alpha = prior["alpha"] - 0.5 * FLAT + 0.5 * counts
    remaining = np.maximum(np.where(found, fits.misfit, 0.0) - (step**2).sum(axis=1), 0.0)
    beta = prior["beta"] + 0.5 * (remaining + (residual**2).sum(axis=1))
    usable = found & (alpha > 0.5) & (beta > 0.0)
    alpha, beta = np.where(usable, alpha, 1.0), np.where(usable, beta, 1.0)
    inverse = np.linalg.inv(r) / scale[:, :, None]
    spread = np.sqrt((inverse**2).sum(axis=2) * (beta / alpha)[:, None])

    def where_usable(values: NDArray[np.floating]) -> Array:
        return np.where(usable, values, np.nan).astype(np.float64)

    return WaveformSummaries(
        friction=where_usable(mean[:, 2]),
        friction_scale=where_usable(spread[:, 2]),
        frequency=where_usable(coefficients[:, 3]),
        frequency_scale=where_usable(spread[:, 3]),
        rest_position=where_usable(coefficients[:, 0]),
        degrees=where_usable(2.0 * alpha),
        noise_sd=where_usable(np.sqrt(beta) * np.exp(gammaln(alpha - 0.5) - gammaln(alpha))),
    )
