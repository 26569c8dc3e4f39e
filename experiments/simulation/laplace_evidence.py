r"""Laplace's approximation to the evidence, the noise scale integrated and the prior cut to its support.

With the mode :math:`\hat z`, deviance :math:`D` at the best noise scale and precision :math:`H` of the ``p``
coordinates,

.. math:: \log E = -\tfrac12 D + \log\pi(\hat z) + \tfrac p2 \log 2\pi - \tfrac12\log|H| + \log P(z\in S),

where the last term is the posterior probability of the support under the normal approximation: fits may
pass the null of a force into values that the prior excludes, which this term penalises. The scale-invariant
prior of the noise scale is improper but the same, on the same samples, for every model that is compared.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from experiments.simulation.box_probability import log_box_probability
from experiments.simulation.coordinates import prior_precision, support_of
from experiments.simulation.fit import LoopFit

__all__ = ["log_evidence", "log_normalisation"]


def log_evidence(fit: LoopFit) -> float:
    """Log-evidence of a fit, up to what all models of the same samples share."""
    # no posterior is wider than the range of a flat prior, the normal volume of this precision
    flat = prior_precision(fit.model) == 0.0
    least = np.where(flat, 2.0 * math.pi, 0.0)
    root = np.linalg.cholesky(fit.precision + np.diag(least))
    centre, objective = fit.centre
    value = -0.5 * objective + log_normalisation(fit)
    value += 0.5 * fit.z.size * math.log(2.0 * math.pi) - float(np.log(np.diag(root)).sum())
    value += math.fsum(noise.log_volume for noise in fit.noises)
    low, high = support_of(fit.model)
    bounded = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    block = fit.covariance[np.ix_(bounded, bounded)]
    return value + log_box_probability(centre[bounded], block, low[bounded], high[bounded])


def log_normalisation(fit: LoopFit) -> float:
    """Logarithm of the prior density of the coordinates at zero distance, within its support."""
    low, high = support_of(fit.model)
    normal = prior_precision(fit.model) > 0.0
    mass = ndtr(high[normal]) - ndtr(low[normal])
    return float(-0.5 * math.log(2.0 * math.pi) * np.count_nonzero(normal) - np.log(mass).sum())
