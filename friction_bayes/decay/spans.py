"""How far the samples of many records go, in all and within a few of each other: what shows at a glance.

Most records hold no stray sample, no leap and no flat top, and a bound that costs one reading of the samples
shows that they cannot. The long forms judge the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.kernels import INNER, KERNEL
from friction_bayes.decay.leaps import widest_gap
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["Extremes", "extremes"]

_NEIGHBOURS = 3
"""Equal samples at an extreme that may be a flat top."""
_APART = 3
"""Samples that those compared with each other are apart at most."""
_LANES, _FOLDS = 64, 4
"""Samples compared side by side, and how often in one go: compilers keep no running largest of one number."""


class Extremes(NamedTuple):
    """What goes farthest in many records, shape (records,) each; not finite where a sample is not.

    Attributes
    ----------
    low, high : ndarray
        Lowest and highest samples.
    widest : ndarray
        Largest distance of two samples up to three apart.
    gap : ndarray
        Largest gap between straight lines through the samples on either side of an interval, see
        :mod:`friction_bayes.decay.leaps`.
    flat : ndarray of bool
        Whether three neighbours are equal at an extreme. As many raise the question whether the sensor ends
        there, see :func:`friction_bayes.records.clipping.clipped_fraction`.
    """

    low: Array
    high: Array
    widest: Array
    gap: Array
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
    gap, flat = np.zeros(count), np.zeros(count, np.bool_)
    for r in range(count):
        y = values[r]
        if _finite(y):
            low[r], high[r], widest[r] = _farthest(y)
            gap[r] = widest_gap(y)
            rounding = ROUNDING * (high[r] - low[r])
            bottom, top = low[r] + rounding, high[r] - rounding
            flat[r] = _beyond(y, bottom, top) >= _NEIGHBOURS and _flat(y, bottom, top)
        else:
            low[r], high[r], widest[r], gap[r] = -np.inf, np.inf, np.inf, np.inf
    return Extremes(low, high, widest, gap, flat)


@njit(**KERNEL, fastmath={"reassoc"})
def _finite(y: Array) -> bool:
    total = 0.0
    for i in range(y.size):
        # of what is not finite this is not a number
        total += 0.0 * y[i]
    return total == 0.0


@njit(**KERNEL)
def _farthest(y: Array) -> tuple[float, float, float]:
    """Extremes of finite samples, and the largest distance of two up to three apart."""
    low, high, widest = np.inf, -np.inf, 0.0
    at_a_time = _LANES * _FOLDS
    beside = np.full(_LANES, np.inf), np.full(_LANES, -np.inf), np.zeros(_LANES)
    whole = max(y.size - _APART, 0) // at_a_time * at_a_time
    for begin in range(0, whole, at_a_time):
        _fold(y[begin : begin + at_a_time + _APART], *beside)
    for j in range(_LANES):
        low, high, widest = min(low, beside[0][j]), max(high, beside[1][j]), max(widest, beside[2][j])
    for i in range(whole, y.size):
        low, high = min(low, y[i]), max(high, y[i])
        for j in range(i + 1, min(i + 1 + _APART, y.size)):
            widest = max(widest, abs(y[j] - y[i]))
    return low, high, widest


@njit(**INNER)
def _fold(part: Array, low: Array, high: Array, widest: Array) -> None:
    """Take over, lane by lane, what goes farther in a part: the range of four samples is their distance."""
    for j in range(_LANES):
        lowest, highest, distance = low[j], high[j], widest[j]
        for k in range(j, j + _LANES * _FOLDS, _LANES):
            a, b, c, d = part[k], part[k + 1], part[k + 2], part[k + 3]
            above, below = (a if a > b else b), (a if a < b else b)
            other_above, other_below = (c if c > d else d), (c if c < d else d)
            above = above if above > other_above else other_above
            below = below if below < other_below else other_below
            highest = above if above > highest else highest
            lowest = below if below < lowest else lowest
            reach = above - below
            distance = reach if reach > distance else distance
        low[j], high[j], widest[j] = lowest, highest, distance


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
