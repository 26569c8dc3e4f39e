r"""Robust ("sandwich") covariance of a model whose residual is more than noise.

Where the residual follows the motion, its samples are not independent, as the posterior assumes. The scatter
of the scores of stretches of the record still gives the uncertainty of the parameters: with the score
:math:`s_b` of each of the ``m`` stretches and the precision :math:`H` of the posterior,

.. math:: C = H^{-1} + \frac{m}{m-1} H^{-1} \Big(\sum_b s_b s_b^T\Big) H^{-1},

the posterior's covariance and the clustered sandwich (White 1982; Liang and Zeger 1986). On noise alone both
terms are the same and the variance would come out twice too large: for failed residual tests only.
"""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.simulation.fit import LoopFit

__all__ = ["robust_covariance"]

_STRETCHES = 10
"""Stretches of a record: each several half cycles long, and enough of them to scatter."""


def robust_covariance(fit: LoopFit) -> Array:
    """Covariance of the coordinates with the scatter of a residual that is more than noise, shape (p, p)."""
    spread = np.zeros_like(fit.precision)
    for jacobian, noise, segment in zip(fit.jacobians, fit.noises, fit.model.segments, strict=True):
        scores = jacobian * (noise.weight * noise.residual)[:, None]
        starts = np.linspace(0, segment.moving, _STRETCHES + 1).astype(int)[:-1]
        sums = np.add.reduceat(scores, starts, axis=0)
        spread += _STRETCHES / (_STRETCHES - 1.0) * sums.T @ sums
    own = fit.covariance
    return np.asarray(own + own @ spread @ own)
