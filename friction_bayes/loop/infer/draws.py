"""Number of draws of a posterior, and their allocation to its parts."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array, Integers

__all__ = ["DRAWS", "shared_out"]

DRAWS = 4000


def shared_out(draws: int, weight: Array, rng: np.random.Generator) -> Integers:
    """Number of draws from each part of a mixture, shape (parts,): in proportion to its share, within one.

    Systematic sampling (Kitagawa, J. Comput. Graph. Stat. 5, 1996), unbiased as multinomial numbers are, but
    without their scatter, which an sd due to a few far draws would inherit.

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
