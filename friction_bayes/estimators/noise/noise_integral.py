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

import numpy as np

from friction_bayes.conjugate.mixture import OMITTED
from friction_bayes.core.arrays import Array
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
    found = [
        (point, *_noises(problem, prior, point))
        for point in posterior.points
        if np.isfinite(point.found.log_weight[0])
    ]
    least = max(float(np.max(log_weight + log_volume)) for _, _, log_weight, log_volume in found)
    least += math.log(OMITTED)
    points = [
        GridPoint(
            ratio=point.ratio,
            tau=point.tau,
            log_volume=float(log_volume[k]),
            found=SetEvidences(log_weight[k : k + 1], noise2[k : k + 1], point.found.full_noise2),
        )
        for point, noise2, log_weight, log_volume in found
        for k in np.flatnonzero(log_weight + log_volume > least).tolist()
    ]
    return Posterior(problem, points)


def _noises(problem: Problem, prior: ForcePrior, point: GridPoint) -> tuple[Array, Array, Array]:
    """Variances of the noise at a point, and log evidence and log prior probability of each."""
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
    return variance, 0.5 * value, log_prior + math.log(step)
