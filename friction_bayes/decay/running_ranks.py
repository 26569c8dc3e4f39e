"""Ranks among the samples around each: what those say of where it should be, whatever one or two are."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["ranks_of_seven"]

_AROUND = 3
"""Samples on either side."""


def ranks_of_seven(values: Array) -> tuple[Array, Array, Array]:
    """Second, fourth and fifth, in ascending order, of each sample with its three on either side.

    At the ends the samples are mirrored.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    second, fourth, fifth : ndarray, shape (n,)
    """
    second, fourth, fifth = _ranks(np.pad(values, _AROUND, mode="reflect"))
    return second, fourth, fifth


@njit(**KERNEL)
def _ranks(x: Array) -> tuple[Array, Array, Array]:
    n = x.size - 2 * _AROUND
    second, fourth, fifth = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        # a sorting network, so that compilers take several samples at a time
        a, g = _ordered(x[i], x[i + 6])
        c, d = _ordered(x[i + 2], x[i + 3])
        e, f = _ordered(x[i + 4], x[i + 5])
        a, c = _ordered(a, c)
        b, e = _ordered(x[i + 1], e)
        d, g = _ordered(d, g)
        a, b = _ordered(a, b)
        c, f = _ordered(c, f)
        d, e = _ordered(d, e)
        b, c = _ordered(b, c)
        e, g = _ordered(e, g)
        c, d = _ordered(c, d)
        e, f = _ordered(e, f)
        second[i], _ = _ordered(b, c)
        fourth[i], fifth[i] = _ordered(d, e)
    return second, fourth, fifth


@njit(**INNER)
def _ordered(one: float, other: float) -> tuple[float, float]:
    return (one, other) if one < other else (other, one)
