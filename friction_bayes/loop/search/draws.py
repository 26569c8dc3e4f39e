"""Draws from the posterior: of one fit, or of all candidates in proportion to their probability."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.robust_covariance import robust_covariance
from friction_bayes.loop.search.truncated_normal import truncated_draws

__all__ = ["DRAWS", "candidate_draws", "posterior_draws", "shared_out"]

DRAWS = 4000
_LEAST_PROBABILITY = 1e-4
"""Candidates below it are not drawn from."""


def shared_out(draws: int, weight: Array, rng: np.random.Generator) -> Integers:
    """How many of some draws each part of a mixture has, shape (parts,): as many as its share, within one.

    Systematic sampling (Kitagawa, J. Comput. Graph. Stat. 5, 1996). Each part has its share on the average,
    as with multinomial numbers; but those scatter, and an sd that a few far draws make scatters with them.

    Parameters
    ----------
    draws : int
    weight : ndarray, shape (parts,)
        Not negative; need not add up to one.
    rng : numpy.random.Generator
    """
    upto = np.cumsum(weight)
    # the last is one without rounding
    whole = np.floor(draws * (upto / upto[-1]) + rng.random()).astype(np.intp)
    return np.diff(whole, prepend=0)


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
    counts = shared_out(DRAWS, kept, rng)
    return [
        posterior_draws(fit, rng, int(k), robust_covariance(fit) if robust else None)
        if k
        else np.empty((0, fit.z.size))
        for fit, k in zip(fits, counts, strict=True)
    ]
