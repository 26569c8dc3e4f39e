"""Posteriors of many whole-signal fits at once, equal to those of one record up to rounding."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from friction_bayes.conjugate.regression_batch import RegressionPosteriors, update_regressions
from friction_bayes.core.arrays import Integers
from friction_bayes.estimators.waveform.least_squares import WaveformFits, prior_of
from friction_bayes.estimators.waveform.normal_equations import COEFFICIENTS

__all__ = ["waveform_posteriors"]


def waveform_posteriors(
    fits: WaveformFits, counts: Integers, prior: Mapping[str, float]
) -> RegressionPosteriors:
    """Update the prior with every fit, linearised at its optimum.

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
    gradient = np.where(found[:, None], fits.gradient, 0.0)
    lower = np.linalg.cholesky(normal)
    factor = lower.swapaxes(-1, -2)
    step = np.linalg.solve(lower, gradient[..., None])[..., 0]
    remaining = np.maximum(np.where(found, fits.misfit, 0.0) - (step**2).sum(axis=1), 0.0)
    projected = np.einsum("rij,rj->ri", factor, coefficients) + step
    return update_regressions(prior_of(prior, COEFFICIENTS), factor, projected, remaining, counts, found)
