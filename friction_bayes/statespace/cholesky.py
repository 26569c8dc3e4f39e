"""Cholesky factors of small matrices by loops: the library's cost the compiler seconds."""

from __future__ import annotations

import math

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, njit

__all__ = ["factor", "forward"]

_LEAST_PIVOT = 1e-300


@njit(**INNER)
def factor(a: Array, size: int) -> None:
    """Cholesky in place, lower triangle."""
    for i in range(size):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            a[i, j] = math.sqrt(max(total, _LEAST_PIVOT)) if i == j else total / a[j, j]


@njit(**INNER)
def forward(a: Array, rhs: Array, size: int, out: Array) -> float:
    """Solve with the lower triangle; returns the squared length of the solution."""
    square = 0.0
    for i in range(size):
        total = rhs[i]
        for k in range(i):
            total -= a[i, k] * out[k]
        out[i] = total / a[i, i]
        square += out[i] * out[i]
    return square
