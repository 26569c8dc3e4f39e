"""Where a position leaps from one sample to the next, as no motion does: two recordings in one, or a slip."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["find_leap"]

_AROUND = 4
"""Samples on either side through which a straight line goes on to the middle of an interval."""
_SKIPPED = 2
"""Samples beside the interval without which a leap is still there, and a stray sample is not."""
_OF_RANGE = 0.1
"""Share of the range of all samples that a leap exceeds."""
_OF_OTHERS = 4.0
"""Times what is usual in the other intervals, 5 % of them apart, that it exceeds besides."""


def find_leap(values: Array) -> tuple[int, float] | None:
    """Find the largest leap of a position.

    Both sides of every interval are extrapolated into its middle. There a smooth motion meets itself, but for
    the noise and, coarsely sampled, for its third derivative: as it does in all other intervals.

    Parameters
    ----------
    values : ndarray, shape (n,)
        At even times.

    Returns
    -------
    index, size : int and float
        The sample before it, and how far it goes; None where there is none.
    """
    gaps = _gaps(values, 0)
    if gaps.size == 0:
        return None
    k = int(np.argmax(np.abs(gaps)))
    size, usual = float(gaps[k]), float(np.quantile(np.abs(gaps), 0.95))
    if abs(size) <= max(_OF_RANGE * float(np.ptp(values)), _OF_OTHERS * usual):
        return None
    index = k + _AROUND - 1
    # the same interval, from farther away
    reach = _AROUND + _SKIPPED
    beside = values[max(index + 1 - reach, 0) : index + 1 + reach]
    if beside.size < 2 * reach or not _gaps(beside, _SKIPPED)[0] / size > 0.5:
        return None
    return index, size


def _gaps(values: Array, skipped: int) -> Array:
    """Extrapolated from the right less from the left, in the middle of every interval that has both."""
    at = np.arange(_AROUND) + 0.5 + skipped
    weights = 1.0 / _AROUND - (at - at.mean()) * at.mean() / np.sum((at - at.mean()) ** 2)
    kernel = np.concatenate([-weights[::-1], np.zeros(2 * skipped), weights])
    if values.size < kernel.size:
        return np.empty(0)
    return np.correlate(values, kernel, "valid")
