"""Small least squares by the normal equations: their moments and their solution, compiled.

The designs have a handful of columns near orthogonal to each other (a constant, cosines and sines), for
which the normal equations lose no digits that matter; loops, because matrix products and slices cost the
compiler seconds.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["add_sample", "regression", "solve_spd"]


@njit(**INNER)
def add_sample(matrix: Array, right: Array, basis: Array, value: float, weight: float) -> None:
    """Add one sample to the moments ``X'WX`` (lower triangle) and ``X'Wy`` of a regression.

    Parameters
    ----------
    matrix, right : ndarray, shapes (d, d) and (d,)
        The moments, in place.
    basis : ndarray, shape (d,)
        Its row of the design.
    value, weight : float
        Its response, and inverse variance relative to a sample of weight 1.
    """
    for a in range(basis.size):
        weighted = weight * basis[a]
        right[a] += weighted * value
        for b in range(a + 1):
            matrix[a, b] += weighted * basis[b]


@njit(**KERNEL)
def solve_spd(matrix: Array, right: Array) -> tuple[Array, bool]:
    """Solve ``matrix x = right`` by Cholesky; False when the (scaled) matrix is not positive definite.

    Parameters
    ----------
    matrix : ndarray, shape (d, d)
        Symmetric; only the lower triangle is read.
    right : ndarray, shape (d,)
    """
    d = right.size
    # the solution in the row behind the factor: an array takes longer to get than to use
    lower = np.zeros((d + 1, d))
    x = lower[d]
    for i in range(d):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > 1e-13 * matrix[i, i]:
                    return x, False
                lower[i, i] = math.sqrt(total)
            else:
                lower[i, j] = total / lower[j, j]
    for i in range(d):
        total = right[i]
        for k in range(i):
            total -= lower[i, k] * x[k]
        x[i] = total / lower[i, i]
    for i in range(d - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, d):
            total -= lower[k, i] * x[k]
        x[i] = total / lower[i, i]
    return x, True


@njit(**INNER)
def regression(matrix: Array, right: Array, square: float) -> tuple[Array, float]:
    """Coefficients and residual sum of squares of a regression from its moments; inf when singular.

    ``square`` is the (weighted) sum of squares of the responses.
    """
    x, ok = solve_spd(matrix, right)
    if not ok:
        return x, math.inf
    rest = square
    for k in range(x.size):
        rest -= x[k] * right[k]
    return x, max(rest, 0.0)
