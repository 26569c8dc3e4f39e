"""Where a position leaps from one sample to the next, as no motion does: two recordings in one, or a slip."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = ["ONWARD", "around_release", "find_leap", "leaps_possible", "may_leap"]

_AROUND = 4
"""Samples on either side through which a straight line goes on to the middle of an interval."""
_SKIPPED = 2
"""Samples next to the interval without which a leap is still there, and a stray sample is not."""
_LEAST_LEAP = 0.1
"""Share of the range of all samples that a leap exceeds."""
_FIRST, _SHARE = 1000, 16
"""First samples, whose range is looked at: so many, or one part in so many; a decay goes farthest there."""
_OF_OTHERS = 4.0
"""Times what is usual in the other intervals, 5 % of them apart, that it exceeds too."""
_AT_A_TIME = 256
"""Gaps that are looked at side by side."""
_ROUNDING = 1.0 - 1e-9
"""Share of a limit that rounding in another order does not reach."""


def find_leap(values: Array, recorded: Mask | None = None) -> tuple[int, float] | None:
    """Find the largest leap of a position.

    Both sides of every interval are extrapolated into its middle. There a smooth motion meets itself, but for
    the noise and, coarsely sampled, for its third derivative: as it does in all other intervals.

    Parameters
    ----------
    values : ndarray, shape (n,)
        At even times.
    recorded : ndarray of bool, shape (n,), optional
        Which of them are samples; others were put between these, and say nothing. All by default.

    Returns
    -------
    index, size : int and float
        The sample before it, and how far it goes; None where there is none.
    """
    # of the intervals that have both kinds of neighbours
    gaps = _gaps(values, 0)[_SKIPPED:-_SKIPPED]
    if gaps.size == 0:
        return None
    if recorded is not None:
        reached = np.ones(2 * (_AROUND + _SKIPPED))
        gaps = np.where(np.correlate(~recorded, reached, "valid") > 0.0, 0.0, gaps)
    k = int(np.argmax(np.abs(gaps)))
    size = float(gaps[k])
    if abs(size) <= _LEAST_LEAP * float(np.ptp(values)):
        return None
    skipping = _gaps(values, _SKIPPED)
    # the leap is in all intervals whose samples reach over it, which are many of a short stretch
    others = np.abs(np.arange(gaps.size) - k) >= _AROUND + _SKIPPED
    if not others.any():
        return None
    least = [_OF_OTHERS * float(np.quantile(np.abs(some[others]), 0.95)) for some in (gaps, skipping)]
    if abs(size) <= least[0]:
        return None
    if np.sign(size) * skipping[k] <= max(0.5 * abs(size), least[1]):
        return None
    return k + _AROUND + _SKIPPED - 1, size


def _onward(skipped: int) -> Array:
    """Weights by which a straight line through the samples behind a gap goes on to its middle."""
    at = np.arange(_AROUND) + 0.5 + skipped
    return np.asarray(1.0 / _AROUND - (at - at.mean()) * at.mean() / np.sum((at - at.mean()) ** 2))


ONWARD = tuple(_onward(0).tolist())
"""Weights of the samples on either side of an interval in the gap in its middle, the nearest first."""


@njit(**KERNEL)
def around_release(begin: int, omega: float) -> tuple[int, int]:
    """First sample of the period before the first sample of a decay, and the end of the period after."""
    period = math.ceil(2.0 * math.pi / omega)
    return max(begin - period, 0), begin + period


@njit(**KERNEL)
def leaps_possible(
    values: Array, start: Integers, stop: Integers, frequency: Array, gap: Array, which: Mask
) -> Mask:
    """Which records :func:`find_leap` may find one in, in the decay or about its release, shape (records,).

    Parameters
    ----------
    values : ndarray, shape (records, n)
    start, stop, frequency : ndarray, shape (records,)
        Where the decay lies, and its frequency [rad/sample].
    gap : ndarray, shape (records,)
        No less than the widest gap.
    which : ndarray of bool, shape (records,)
        The records that are looked at.
    """
    found = np.zeros(which.size, np.bool_)
    for r in range(which.size):
        if which[r]:
            first, last = around_release(start[r], frequency[r])
            found[r] = may_leap(values[r, first : min(last, stop[r])], gap[r])
            found[r] |= may_leap(values[r, start[r] : stop[r]], gap[r])
    return found


@njit(**KERNEL)
def may_leap(values: Array, gap: float) -> bool:
    """Whether :func:`find_leap` has anything to look at in finite ``values``, shape (n,).

    ``gap`` is no less than the widest gap.
    """
    if values.size < 2 * _AROUND:
        return False
    low = high = values[0]
    # the range of all is no less
    for i in range(min(max(_FIRST, values.size // _SHARE), values.size)):
        low, high = min(low, values[i]), max(high, values[i])
    if gap <= _ROUNDING * _LEAST_LEAP * (high - low):
        return False
    # where more than 5 % are a quarter as large the largest is no leap, whichever it is compared with
    few = 0.05 * values.size + 2 * (_AROUND + _SKIPPED) + 2 * _SKIPPED
    limit, wide = _ROUNDING * gap / _OF_OTHERS, 0
    for begin in range(0, values.size, _AT_A_TIME):
        wide += _wider_gaps(values[begin : begin + _AT_A_TIME + 2 * _AROUND - 1], limit)
        if wide > few:
            return False
    return True


@njit(**INNER, fastmath={"contract"})
def _wider_gaps(values: Array, limit: float) -> int:
    """How many gaps are wider than a limit."""
    w0, w1, w2, w3 = ONWARD
    a, b, c = values[1:], values[2:], values[3:]
    d, e, f, g = values[4:], values[5:], values[6:], values[7:]
    count = 0
    for i in range(values.size - 7):
        gap = w0 * (d[i] - c[i]) + w1 * (e[i] - b[i]) + w2 * (f[i] - a[i]) + w3 * (g[i] - values[i])
        count += abs(gap) > limit
    return count


def _gaps(values: Array, skipped: int) -> Array:
    """Extrapolated from the right less from the left, in the middle of every interval that has both."""
    weights = _onward(skipped)
    kernel = np.concatenate([-weights[::-1], np.zeros(2 * skipped), weights])
    if values.size < kernel.size:
        return np.empty(0)
    return np.correlate(values, kernel, "valid")
