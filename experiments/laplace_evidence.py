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

from friction_bayes.loop.infer.truncated_normal import log_box_probability
from friction_bayes.loop.simulation.fit import LoopFit

__all__ = ["log_evidence"]


def log_evidence(fit: LoopFit) -> float:
    """Log-evidence of a fit, up to what all models of the same samples share."""
    least = np.array([c.least_precision for c in fit.model.coordinates])
    root = np.linalg.cholesky(fit.precision + np.diag(least))
    centre, objective = fit.centre
    value = -0.5 * objective + math.fsum(c.log_normalisation for c in fit.model.coordinates)
    value += 0.5 * fit.z.size * math.log(2.0 * math.pi) - float(np.log(np.diag(root)).sum())
    value += math.fsum(noise.log_volume for noise in fit.noises)
    low, high = fit.model.support
    bounded = np.flatnonzero(np.isfinite(low) | np.isfinite(high))
    block = fit.covariance[np.ix_(bounded, bounded)]
    return value + log_box_probability(centre[bounded], block, low[bounded], high[bounded])
