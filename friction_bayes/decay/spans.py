"""How far the samples of many records go, in all and within a few of each other: what shows at a glance.

Most records hold no stray sample, no leap and no flat top, and a bound that costs one reading of the samples
shows that they cannot. The long forms judge the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

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
_SINGLE = 1e-6
"""Share of the range by which rounding to single precision moves no distance and no gap."""


class Extremes(NamedTuple):
    """What goes farthest in many records, shape (records,) each; not finite where a sample is not.

    Attributes
    ----------
    low, high : ndarray
        Lowest and highest samples.
    widest : ndarray
        No less than the largest distance of two samples up to three apart, to single precision.
    gap : ndarray
        Likewise the largest gap between straight lines through the samples on either side of an interval, see
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
    share = np.empty(values.shape[1], np.float32)
    for r in range(count):
        y = values[r]
        low[r], high[r] = _range(y)
        span = high[r] - low[r]
        if 0.0 < span < np.inf:
            _fill_shares(y, low[r], 1.0 / span, share)
            widest[r] = (_farthest(share) + _SINGLE) * span
            gap[r] = (widest_gap(share) + _SINGLE) * span
            flat[r] = _at_ends(share) >= _NEIGHBOURS
            flat[r] = flat[r] and _flat(y, low[r] + ROUNDING * span, high[r] - ROUNDING * span)
        elif y.size > 0:
            widest[r], gap[r], flat[r] = span, span, span == 0.0 and y.size >= _NEIGHBOURS
    return Extremes(low, high, widest, gap, flat)


@njit(**KERNEL)
def _range(y: Array) -> tuple[float, float]:
    """Extremes of the samples; infinite where one is not finite."""
    low, high, nothing = np.inf, -np.inf, 0.0
    lowest, highest, zeros = np.full(_LANES, np.inf), np.full(_LANES, -np.inf), np.zeros(_LANES)
    whole = y.size // _LANES * _LANES
    for begin in range(0, whole, _LANES):
        part = y[begin : begin + _LANES]
        for j in range(_LANES):
            value = part[j]
            lowest[j] = value if value < lowest[j] else lowest[j]
            highest[j] = value if value > highest[j] else highest[j]
            # of what is not finite this is not a number
            zeros[j] += 0.0 * value
    for j in range(_LANES):
        low, high, nothing = min(low, lowest[j]), max(high, highest[j]), nothing + zeros[j]
    for i in range(whole, y.size):
        low, high, nothing = min(low, y[i]), max(high, y[i]), nothing + 0.0 * y[i]
    return (low, high) if nothing == 0.0 else (-np.inf, np.inf)


@njit(**KERNEL)
def _fill_shares(y: Array, low: float, scale: float, share: NDArray[np.float32]) -> None:
    """Fill in the samples as shares of their range."""
    for i in range(y.size):
        share[i] = (y[i] - low) * scale


@njit(**KERNEL)
def _farthest(y: NDArray[np.float32]) -> float:
    """Largest distance of two samples up to three apart."""
    at_a_time, widest = _LANES * _FOLDS, np.float32(0.0)
    lanes = np.zeros(_LANES, np.float32)
    whole = max(y.size - _APART, 0) // at_a_time * at_a_time
    for begin in range(0, whole, at_a_time):
        _fold(y[begin : begin + at_a_time + _APART], lanes)
    for j in range(_LANES):
        widest = max(widest, lanes[j])
    for i in range(whole, y.size):
        for j in range(i + 1, min(i + 1 + _APART, y.size)):
            widest = max(widest, abs(y[j] - y[i]))
    return float(widest)


@njit(**INNER)
def _fold(part: NDArray[np.float32], widest: NDArray[np.float32]) -> None:
    """Take over, lane by lane, what goes farther in a part: the range of four samples is their distance."""
    for j in range(_LANES):
        distance = widest[j]
        for k in range(j, j + _LANES * _FOLDS, _LANES):
            a, b, c, d = part[k], part[k + 1], part[k + 2], part[k + 3]
            above, below = (a if a > b else b), (a if a < b else b)
            other_above, other_below = (c if c > d else d), (c if c < d else d)
            above = above if above > other_above else other_above
            below = below if below < other_below else other_below
            reach = above - below
            distance = reach if reach > distance else distance
        widest[j] = distance


@njit(**KERNEL, fastmath={"reassoc"})
def _at_ends(share: NDArray[np.float32]) -> float:
    """How many samples lie at either end of their range; counted in single precision, several at a time."""
    bottom, top = np.float32(_SINGLE), np.float32(1.0 - _SINGLE)
    one, count = np.float32(1.0), np.float32(0.0)
    for i in range(share.size):
        count += one if share[i] >= top or share[i] <= bottom else np.float32(0.0)
    return float(count)


@njit(**KERNEL)
def _flat(y: Array, bottom: float, top: float) -> bool:
    above = below = 0
    for i in range(y.size):
        above = above + 1 if y[i] >= top else 0
        below = below + 1 if y[i] <= bottom else 0
        if above >= _NEIGHBOURS or below >= _NEIGHBOURS:
            return True
    return False
