"""Readings that are joined by straight lines: a slow sensor's, exported at a faster rate.

Between two readings such a record is straight to the last digit, and bends at every so many-th sample. Taken
for samples, the points between cut the corners of the motion: a swing looks smaller than it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.records.quantisation import ROUNDING, quantisation_step

__all__ = ["joined_readings"]

_STRAIGHT = 0.05
"""Bend between readings over the usual bend at them, at the most, where no step shows that digits are printed
with: without lines some sample between would bend as much as those."""
_USUAL = 0.25
"""Quantile of the bends at readings that is taken for all: some bend little, where the signal does."""
_FEWEST = 8
"""Readings that it takes."""
_LONGEST = 200
"""Samples from one reading to the next that are looked for."""
_LOOKED_AT = 4096
"""Samples in which that distance is looked for; all are then held against it."""


def joined_readings(values: ArrayLike) -> Mask:
    """Find the samples that lie on straight lines between readings.

    Parameters
    ----------
    values : array_like, shape (n,)
        The signal as recorded, evenly spaced in time.

    Returns
    -------
    ndarray of bool, shape (n,)
        None where the record is not made of lines of one length.
    """
    signal = np.asarray(values, dtype=np.float64)
    between = np.zeros(signal.size, dtype=np.bool_)
    bend = np.abs(np.diff(signal, 2))
    few = bend[:_LOOKED_AT]
    if few.size < 2 * _FEWEST:
        return between
    # at most half of the samples are readings
    least = float(np.quantile(few, 0.45))
    straight = least <= _STRAIGHT * few.max()
    if not straight and _printed_finer(signal, least):
        return between
    # the sum of three roundings, one of them twice
    printed = (2.0 + ROUNDING) * (quantisation_step(signal) or 0.0)
    if not (straight or least <= printed):
        return between
    for length in range(2, min(_LONGEST, few.size // _FEWEST) + 1):
        place = _place_of_bends(few, length, printed)
        if place is not None and _place_of_bends(bend, length, printed) == place:
            between[:] = True
            # the first bend is that of the second sample
            between[(place + 1) % length :: length] = False
            return between
    return between


def _printed_finer(signal: Array, bend: float) -> bool:
    """Whether printed digits surely make no such bend, as two values are too near each other.

    A step is at most 2.25 times the least gap between values, rounding aside, and a bend has two.
    """
    gaps = np.diff(np.sort(signal[:_LOOKED_AT]))
    rounding = signal.size * ROUNDING * np.ptp(signal)
    return bool(np.any((gaps > rounding) & (4.6 * gaps < bend)))


def _place_of_bends(bend: Array, length: int, printed: float) -> int | None:
    """Which of every ``length`` samples bends, the others being straight; None where more do, or none.

    Straight to the digits that are ``printed``, where these are fewer than half of a bend.
    """
    folded = bend[: bend.size // length * length].reshape(-1, length)
    # of half of this length every other bend would be straight
    usual = np.quantile(folded, _USUAL, axis=0)
    place = int(np.argmax(usual))
    others = np.delete(folded, place, axis=1).max()
    straight = others < _STRAIGHT * usual[place] or others <= printed < 0.5 * usual[place]
    return place if straight else None
