"""Draws from the posterior: of one fit, or of all candidates in proportion to their probability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.robust_covariance import robust_covariance
from friction_bayes.loop.truncated_normal import truncated_draws

__all__ = ["DRAWS", "candidate_draws", "posterior_draws"]

DRAWS = 4000
_LEAST_PROBABILITY = 1e-4
"""Candidates below it are not drawn from."""


def posterior_draws(
    fit: LoopFit, rng: np.random.Generator, draws: int, covariance: Array | None = None
) -> Array:
    """Draw coordinates from the normal approximation cut to the support, shape (draws, p).

    Another ``covariance`` than the posterior's may be given.
    """
    spread = fit.covariance if covariance is None else covariance
    return truncated_draws(fit.centre[0], spread, *fit.model.support, rng, draws)


def candidate_draws(
    fits: Sequence[LoopFit], probabilities: Array, rng: np.random.Generator, *, robust: bool
) -> list[Array]:
    """Draw coordinates from each candidate in proportion to its probability, shape (k, p) each.

    Parameters
    ----------
    fits : sequence of LoopFit
    probabilities : ndarray, shape (c,)
    rng : numpy.random.Generator
    robust : bool
        Whether the draws carry the scatter of a residual that is more than noise.
    """
    kept = np.where(probabilities > _LEAST_PROBABILITY, probabilities, 0.0)
    counts = rng.multinomial(DRAWS, kept / kept.sum())
    return [
        posterior_draws(fit, rng, int(k), robust_covariance(fit) if robust else None)
        if k
        else np.empty((0, fit.z.size))
        for fit, k in zip(fits, counts, strict=True)
    ]
