"""How far the samples of many records go, in all and within a few of each other: what shows at a glance.

Most records hold no stray sample, no leap and no flat top, and a bound that costs one reading of the samples
shows that they cannot. The long forms judge the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.leaps import ONWARD
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["Extremes", "extremes", "has_repeats"]

_NEIGHBOURS = 3
"""Equal samples at an extreme that may be a flat top."""
_AT_A_TIME, _LANES, _DISTANCES = 1024, 64, 256
"""Samples that are read while they are near, and how many of them, and of their distances, are compared side
by side: compilers keep no running largest of one number."""
_AHEAD = 2 * len(ONWARD) - 1
"""Samples behind the first of those compared with each other."""
_APART = 3
"""Samples whose distance is compared are apart at most."""
_SINGLE = 1e-6
"""Share of the range by which rounding to single precision moves no distance and no gap."""
_SMALLEST, _LARGEST = 1e-30, 1e30
"""Ranges that single precision has room for."""


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
    repeats : ndarray of bool
        Whether two neighbours are equal: without, there are no dropouts.
    flat : ndarray of bool
        Whether three neighbours are equal at an extreme. As many raise the question whether the sensor ends
        there, see :func:`friction_bayes.records.clipping.clipped_fraction`.
    """

    low: Array
    high: Array
    widest: Array
    gap: Array
    repeats: Mask
    flat: Mask

    @property
    def finite(self) -> Mask:
        """Whether all samples of a record are."""
        return np.isfinite(self.low) & np.isfinite(self.high)


@njit(**KERNEL)
def extremes(values: Array) -> Extremes:
    """Extremes of records, shape (records, n), each read once."""
    count, n = values.shape
    low, high, widest = np.full(count, np.inf), np.full(count, -np.inf), np.zeros(count)
    gap, repeats, flat = np.zeros(count), np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    lowest, highest = np.empty(_LANES), np.empty(_LANES)
    about = np.empty(_AT_A_TIME + _AHEAD, np.float32)
    ends = np.empty((n // _AT_A_TIME + 1, 2))
    for r in range(count):
        y = values[r]
        far, wide = np.zeros(_DISTANCES, np.float32), np.zeros(_DISTANCES, np.float32)
        for begin in range(0, n, _AT_A_TIME):
            part = y[begin : begin + _AT_A_TIME + _AHEAD]
            bottom, top = _range(part, lowest, highest)
            low[r], high[r] = min(low[r], bottom), max(high[r], top)
            ends[begin // _AT_A_TIME, 0], ends[begin // _AT_A_TIME, 1] = bottom, top
            repeats[r] |= has_repeats(part[: _AT_A_TIME + 1])
            _fill_about_first(part, about)
            for at in range(0, part.size, _DISTANCES):
                _widen(about[at : min(at + _DISTANCES + _AHEAD, part.size)], far, wide)
        span = high[r] - low[r]
        if _SMALLEST < span < _LARGEST:
            # the last samples have none so far behind them
            for i in range(max(n - _AHEAD, 0), n):
                for j in range(i + 1, min(i + 1 + _APART, n)):
                    widest[r] = max(widest[r], abs(y[j] - y[i]))
            for j in range(_DISTANCES):
                widest[r], gap[r] = max(widest[r], far[j]), max(gap[r], wide[j])
            widest[r] += _SINGLE * span
            gap[r] += _SINGLE * span
        else:
            widest[r], gap[r] = span, 2.0 * span
        bottom, top = low[r] + ROUNDING * span, high[r] - ROUNDING * span
        for begin in range(0, n, _AT_A_TIME):
            if ends[begin // _AT_A_TIME, 0] <= bottom or ends[begin // _AT_A_TIME, 1] >= top:
                flat[r] |= _flat(y[begin : begin + _AT_A_TIME + _AHEAD], bottom, top)
    return Extremes(low, high, widest, gap, repeats, flat)


@njit(**INNER)
def _range(y: Array, lowest: Array, highest: Array) -> tuple[float, float]:
    """Extremes of the samples; infinite where one is not finite."""
    low, high = np.inf, -np.inf
    for j in range(_LANES):
        lowest[j], highest[j] = np.inf, -np.inf
    whole = y.size // _LANES * _LANES
    for begin in range(0, whole, _LANES):
        part = y[begin : begin + _LANES]
        for j in range(_LANES):
            value = part[j]
            lowest[j] = value if value < lowest[j] else lowest[j]
            highest[j] = value if value > highest[j] else highest[j]
    for j in range(_LANES):
        low, high = min(low, lowest[j]), max(high, highest[j])
    for i in range(whole, y.size):
        low, high = min(low, y[i]), max(high, y[i])
    return (low, high) if _zeros(y) == 0.0 else (-np.inf, np.inf)


@njit(**INNER, fastmath={"reassoc"})
def _zeros(y: Array) -> float:
    """Zero times the samples, added up: not a number where one is not finite."""
    total = 0.0
    for i in range(y.size):
        total += 0.0 * y[i]
    return total


@njit(**KERNEL)
def has_repeats(values: Array) -> bool:
    """Whether two neighbours of samples, shape (n,), are equal: without, there are no dropouts."""
    count = 0
    for i in range(values.size - 1):
        count += values[i] == values[i + 1]
    return count > 0


@njit(**INNER)
def _fill_about_first(y: Array, about: NDArray[np.float32]) -> None:
    """Fill in the samples less the first of them."""
    for i in range(y.size):
        about[i] = y[i] - y[0]


@njit(**INNER, fastmath={"contract"})
def _widen(part: NDArray[np.float32], far: NDArray[np.float32], wide: NDArray[np.float32]) -> None:
    """Take over, each in its own place, wider distances and gaps of a part.

    The range of four samples is their distance.
    """
    w0, w1 = np.float32(ONWARD[0]), np.float32(ONWARD[1])
    w2, w3 = np.float32(ONWARD[2]), np.float32(ONWARD[3])
    for j in range(part.size - _AHEAD):
        a, b, c, d = part[j], part[j + 1], part[j + 2], part[j + 3]
        e, f, g, h = part[j + 4], part[j + 5], part[j + 6], part[j + 7]
        gap = abs(w0 * (e - d) + w1 * (f - c) + w2 * (g - b) + w3 * (h - a))
        wide[j] = gap if gap > wide[j] else wide[j]
        above, below = (a if a > b else b), (a if a < b else b)
        other_above, other_below = (c if c > d else d), (c if c < d else d)
        above = above if above > other_above else other_above
        below = below if below < other_below else other_below
        reach = above - below
        far[j] = reach if reach > far[j] else far[j]


@njit(**INNER)
def _flat(y: Array, bottom: float, top: float) -> bool:
    above = below = 0
    for i in range(y.size):
        above = above + 1 if y[i] >= top else 0
        below = below + 1 if y[i] <= bottom else 0
        if above >= _NEIGHBOURS or below >= _NEIGHBOURS:
            return True
    return False
