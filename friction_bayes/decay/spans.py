"""How far the samples of many records go, in all and within a few of each other: what shows at a glance.

Most records hold no stray sample, no leap and no flat top, and a bound that costs one reading of the samples
shows that they cannot. The long forms judge the others.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["REACH", "Spans", "extremes", "not_finite", "spans"]

REACH = 3
"""Samples within which :attr:`Spans.reach` looks."""
_LARGEST = sys.float_info.max


class Spans(NamedTuple):
    """What one reading of many records shows, shape (records,) each.

    Attributes
    ----------
    finite : ndarray of bool
        Whether all samples are; of other records the rest is not to be read.
    range : ndarray
        Of all samples, from lowest to highest.
    reach : ndarray
        Largest difference of two that are up to :data:`REACH` samples apart.
    flat : ndarray of bool
        Whether as many equal neighbours as raise the question of a sensor's end lie at an extreme.
    """

    finite: Mask
    range: Array
    reach: Array
    flat: Mask


def spans(values: Array) -> Spans:
    """Read records, shape (records, n), once."""
    rows = len(values)
    found = Spans(np.ones(rows, np.bool_), np.zeros(rows), np.zeros(rows), np.zeros(rows, np.bool_))
    _read(values, found)
    return found


@njit(cache=True, nogil=True)
def _read(values: Array, found: Spans) -> None:
    for r in range(values.shape[0]):
        y = values[r]
        found.finite[r] = not_finite(y) == 0
        if found.finite[r] and y.size > REACH:
            low, high = extremes(y)
            found.range[r], found.reach[r] = high - low, _reach(y)
            rounding = ROUNDING * (high - low)
            found.flat[r] = _flat_runs(y, low + rounding, high - rounding) > 0


@njit(cache=True, nogil=True)
def not_finite(y: Array) -> int:
    """How many samples are nan or infinite."""
    count = 0
    for i in range(y.size):
        count += not abs(y[i]) <= _LARGEST
    return count


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def extremes(y: Array) -> tuple[float, float]:
    """Lowest and highest of at least one finite number."""
    low, high = y[0], y[0]
    for i in range(y.size):
        low, high = min(low, y[i]), max(high, y[i])
    return low, high


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def _reach(y: Array) -> float:
    """Largest difference of finite numbers up to :data:`REACH` samples apart."""
    reach = 0.0
    first, second, third = y[1:], y[2:], y[3:]
    for i in range(y.size - 3):
        reach = max(reach, abs(first[i] - y[i]))
        reach = max(reach, abs(second[i] - y[i]))
        reach = max(reach, abs(third[i] - y[i]))
    for i in range(y.size - 3, y.size):
        for j in range(i + 1, y.size):
            reach = max(reach, abs(y[j] - y[i]))
    return reach


@njit(cache=True, nogil=True)
def _flat_runs(y: Array, low: float, high: float) -> int:
    """How many samples have their neighbours at the same extreme: the shortest run is three."""
    count = 0
    first, second = y[1:], y[2:]
    for i in range(y.size - 2):
        count += (y[i] >= high) & (first[i] >= high) & (second[i] >= high)
        count += (y[i] <= low) & (first[i] <= low) & (second[i] <= low)
    return count
