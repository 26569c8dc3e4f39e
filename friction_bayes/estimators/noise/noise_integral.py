r"""The posterior of a record of few samples: the noise integrated out at every point of the grid.

:mod:`friction_bayes.statespace.subset_evidence` takes the noise that it finds at a point, with a prior of the
coefficients in units of it. Its degrees of freedom are the samples then, and not these less the coefficients
that they determine, and none is left where it is at the rounding of the sensor: of 200 samples intervals are
1 to 3 % too narrow. Columns of a record's own, as the corners are for a sampler, keep a prior in units of the
noise and are integrated out before. Given the noise the others are normal. With ``G = U diag(g) U'`` the sums
of the columns, ``s`` those with the record less a reference law ``b0``, and ``y`` that of the record,

.. math:: \log p(y|\sigma^2) = -\tfrac12\log|V| - \tfrac n2\log\sigma^2 - \tfrac12\sum_j\log(g_j/\sigma^2 + 1)
          - \tfrac{y}{2\sigma^2} - \tfrac12 |b_0|^2 + \tfrac12\sum_j
          \frac{(U's/\sigma^2 - U'b_0)_j^2}{g_j/\sigma^2 + 1}
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.subset_evidence import SetEvidences

__all__ = ["over_noise"]

_CELLS = 12
"""Values of the noise at a point: equal steps of its logarithm."""
_REACH = 4.0
"""Standard deviations of the logarithm of the noise beyond which there is none."""


def over_noise(problem: Problem, posterior: Posterior, prior: ForcePrior) -> Posterior:
    """The same of one set whose coefficients may have either sign, averaged over the noise at each point.

    Parameters
    ----------
    problem : Problem
        The shared columns are those whose prior does not depend on the noise.
    posterior : Posterior
        At the noise found.
    prior : ForcePrior
        Of the random force, as it was integrated over.
    """
    points = [each for point in posterior.points for each in _noises(problem, prior, point)]
    return Posterior(problem, points)


def _noises(problem: Problem, prior: ForcePrior, point: GridPoint) -> list[GridPoint]:
    """A point at several values of the noise; none where it has no probability."""
    if not np.isfinite(point.found.log_weight[0]):
        return []
    whitened, reference = problem.marginal(point.ratio, point.tau), problem.reference
    n, p = problem.used, reference.size
    found, fewest = math.log(point.found.noise2[0]), max(n - p, 1)
    low = max(found - _REACH * math.sqrt(2.0 / n), problem.log_least_variance)
    high = found + math.log(n / fewest) + _REACH * math.sqrt(2.0 / fewest)
    step = (high - low) / _CELLS
    log_v = low + step * (np.arange(_CELLS) + 0.5)
    size, vectors = np.linalg.eigh(whitened.gram[:-1, :-1])
    variance = np.exp(log_v)
    precision = size / variance[:, None] + 1.0
    score = (vectors.T @ whitened.gram[:-1, -1]) / variance[:, None] - vectors.T @ reference
    value = -whitened.log_determinant - n * log_v - np.log(precision).sum(axis=1)
    value += (score**2 / precision).sum(axis=1) - whitened.gram[-1, -1] / variance - reference @ reference
    log_prior = np.full(_CELLS, math.log(prior.none))
    if point.ratio > 0.0:
        # the cell in size and time, with the prior at each noise
        log_prior = prior.log_density(point.ratio * np.sqrt(variance), point.tau)
        log_prior += point.log_volume - prior.log_density(point.ratio * point.noise, point.tau)
    return [
        replace(
            point,
            log_volume=float(volume),
            found=SetEvidences(np.array([0.5 * weight]), np.array([noise2]), point.found.full_noise2),
        )
        for weight, noise2, volume in zip(value, variance, log_prior + math.log(step), strict=True)
    ]
