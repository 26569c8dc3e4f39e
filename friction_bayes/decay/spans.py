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

__all__ = ["Extremes", "extremes"]

_NEIGHBOURS = 3
"""Equal samples at an extreme that may be a flat top."""
_APART = 3
"""Samples that those compared with each other are apart at most."""
_AT_A_TIME = 256
"""Samples in which those that go farther than all before are counted."""


class Extremes(NamedTuple):
    """What goes farthest in many records, shape (records,) each; not finite where a sample is not.

    Attributes
    ----------
    low, high : ndarray
        Lowest and highest samples.
    widest : ndarray
        Largest distance of two samples up to three apart.
    flat : ndarray of bool
        Whether three neighbours are equal at an extreme. As many raise the question whether the sensor ends
        there, see :func:`friction_bayes.records.clipping.clipped_fraction`.
    """

    low: Array
    high: Array
    widest: Array
    flat: Mask

    @property
    def finite(self) -> Mask:
        """Whether all samples of a record are."""
        return np.isfinite(self.low) & np.isfinite(self.high)


@njit(**KERNEL)
def extremes(values: Array) -> Extremes:
    """Extremes of records, shape (records, n), each read while it is near."""
    count = values.shape[0]
    low, high, widest = np.full(count, np.inf), np.full(count, -np.inf), np.zeros(count)
    flat = np.zeros(count, np.bool_)
    for r in range(count):
        y = values[r]
        if _finite(y):
            low[r], high[r], widest[r] = _farthest(y)
            rounding = ROUNDING * (high[r] - low[r])
            bottom, top = low[r] + rounding, high[r] - rounding
            flat[r] = _beyond(y, bottom, top) >= _NEIGHBOURS and _flat(y, bottom, top)
        else:
            low[r], high[r], widest[r] = -np.inf, np.inf, np.inf
    return Extremes(low, high, widest, flat)


@njit(**KERNEL, fastmath={"reassoc"})
def _finite(y: Array) -> bool:
    total = 0.0
    for i in range(y.size):
        # of what is not finite this is not a number
        total += 0.0 * y[i]
    return total == 0.0


@njit(**KERNEL)
def _farthest(y: Array) -> tuple[float, float, float]:
    """Extremes of finite samples, and the largest distance of two up to three apart.

    Samples that go farther are counted, several at a time, and looked at where there are any: seldom.
    """
    low, high, widest = np.inf, -np.inf, 0.0
    for begin in range(0, y.size, _AT_A_TIME):
        part = y[begin : begin + _AT_A_TIME + _APART]
        if _farther(part, low, high, widest) > 0:
            for i in range(part.size):
                low, high = min(low, part[i]), max(high, part[i])
                for j in range(i + 1, min(i + 1 + _APART, part.size)):
                    widest = max(widest, abs(part[j] - part[i]))
    return low, high, widest


@njit(**KERNEL)
def _farther(part: Array, low: float, high: float, widest: float) -> int:
    first, second, third = part[1:], part[2:], part[3:]
    count = 0
    for i in range(third.size):
        count += (part[i] < low) | (part[i] > high) | (abs(first[i] - part[i]) > widest)
        count += (abs(second[i] - part[i]) > widest) | (abs(third[i] - part[i]) > widest)
    for i in range(third.size, part.size):
        count += (part[i] < low) | (part[i] > high)
        for j in range(i + 1, part.size):
            count += abs(part[j] - part[i]) > widest
    return count


@njit(**KERNEL)
def _beyond(y: Array, bottom: float, top: float) -> int:
    count = 0
    for i in range(y.size):
        count += (y[i] >= top) | (y[i] <= bottom)
    return count


@njit(**KERNEL)
def _flat(y: Array, bottom: float, top: float) -> bool:
    above = below = 0
    for i in range(y.size):
        above = above + 1 if y[i] >= top else 0
        below = below + 1 if y[i] <= bottom else 0
        if above >= _NEIGHBOURS or below >= _NEIGHBOURS:
            return True
    return False
