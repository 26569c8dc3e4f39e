"""How far the samples of many records go, in all and within a few of each other: what shows at a glance.

Most records hold no stray sample, no leap and no flat top, and a bound that costs one reading of the samples
shows that they cannot. The long forms judge the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.kernels import KERNEL
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["Extremes", "extremes", "far_within_three", "flat_extremes"]


class Extremes(NamedTuple):
    """Lowest and highest samples of many records, shape (records,) each; not finite where a sample is not."""

    low: Array
    high: Array

    @property
    def finite(self) -> Mask:
        """Whether all samples of a record are."""
        return np.isfinite(self.low) & np.isfinite(self.high)


def extremes(values: Array) -> Extremes:
    """Extremes of records, shape (records, n)."""
    return Extremes(values.min(axis=1, initial=np.inf), values.max(axis=1, initial=-np.inf))


@njit(**KERNEL)
def far_within_three(values: Array, limit: Array) -> Mask:
    """Whether two samples up to three apart differ by more than a limit, in each record, shape (records,)."""
    found = np.zeros(values.shape[0], np.bool_)
    for r in range(values.shape[0]):
        y, far = values[r], limit[r]
        first, second, third = y[1:], y[2:], y[3:]
        # counts in place of the largest: those the compiler takes several at a time
        count = 0
        for i in range(y.size - 3):
            count += abs(first[i] - y[i]) > far
            count += abs(second[i] - y[i]) > far
            count += abs(third[i] - y[i]) > far
        for i in range(max(y.size - 3, 0), y.size):
            for j in range(i + 1, y.size):
                count += abs(y[j] - y[i]) > far
        found[r] = count > 0
    return found


@njit(**KERNEL)
def flat_extremes(values: Array, seen: Extremes) -> Mask:
    """Whether three neighbours are equal at an extreme, in each record, shape (records,).

    As many raise the question whether the sensor ends there, see
    :func:`friction_bayes.records.clipping.clipped_fraction`.
    """
    found = np.zeros(values.shape[0], np.bool_)
    for r in range(values.shape[0]):
        y, rounding = values[r], ROUNDING * (seen.high[r] - seen.low[r])
        low, high = seen.low[r] + rounding, seen.high[r] - rounding
        first, second = y[1:], y[2:]
        count = 0
        for i in range(y.size - 2):
            count += (y[i] >= high) & (first[i] >= high) & (second[i] >= high)
            count += (y[i] <= low) & (first[i] <= low) & (second[i] <= low)
        found[r] = count > 0
    return found
