"""A smooth curve along a decay about its mean, as friction or the zero of a sensor changes."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["CURVE_SDS", "smooth_curve"]

CURVE_SDS = np.array([1.0, 0.5, 0.25])
"""Prior sds of its columns over that of the first: what changes smoothly has ever less of a higher degree."""
CURVE_SDS.flags.writeable = False


def smooth_curve(place: Array, until: float) -> Array:
    """Legendre polynomials from the first degree on, halved, so that the first changes by one.

    Parameters
    ----------
    place : ndarray, shape (n,)
        Times or phases from zero on.
    until : float
        Where the decay ends.

    Returns
    -------
    ndarray, shape (n, 3)
    """
    return np.asarray(
        0.5 * np.polynomial.legendre.legvander(2.0 * place / until - 1.0, CURVE_SDS.size)[:, 1:]
    )
