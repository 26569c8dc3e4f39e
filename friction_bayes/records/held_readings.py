"""Readings that are held: a logger that reads faster than the sensor measures writes each several times.

A slow sensor behind a fast clock, a camera of 12 pictures a second in a recording of 30, repeats a reading
exactly until it has the next one, however fast the motion. Taken for samples, the repeats are late.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.records.quantisation import ROUNDING, quantisation_step

__all__ = ["held_readings", "least_step"]

_JUMP = 3.5
"""Steps of the sensor, before and after a repeat, from which on the motion did not wait for it."""
_SHARE = 0.2
"""Least share of the samples between such jumps that are repeats."""
_SAME = 1e-4
"""Share of the range below which two levels of a coarse sensor are one."""
_FEWEST = 10
"""Repeats that it takes."""
_CHANCE = 3.0
"""Repeats for every change by one step there, above which they are no chance: noise makes one for two."""


def held_readings(values: ArrayLike) -> Mask:
    """Find the repeats of readings that were held while the motion went on.

    Between two levels of a sensor a slow motion repeats itself, and between two samples noise may: those have
    neighbours a step or two away, and as many changes by one step as repeats. Held readings are left by a
    jump, and reached by one.

    Parameters
    ----------
    values : array_like, shape (n,)
        The signal as recorded.

    Returns
    -------
    ndarray of bool, shape (n,)
        None where too few repeat to be certain.
    """
    signal = np.asarray(values, dtype=np.float64)
    changes = np.abs(np.diff(signal))
    if signal.size - 1 - np.count_nonzero(changes > 0.0) < _FEWEST:
        return np.zeros(signal.size, dtype=np.bool_)
    # at an end of its range a sensor repeats what it cannot show
    rounding = ROUNDING * np.ptp(signal)
    inside = (signal < signal.max() - rounding) & (signal > signal.min() + rounding)
    if not inside.any():
        return inside
    step = least_step(signal[inside])
    starts = np.append(0, np.flatnonzero(changes > 0.0) + 1)
    lengths = np.diff(np.append(starts, signal.size))
    left = np.append(changes[starts[1:] - 1] > _JUMP * step, False)
    reached = np.append(False, left[:-1])
    certainly = left & reached & inside[starts]
    repeats = int(np.sum(lengths[certainly] - 1))
    by_one_step = changes[starts[1:] - 1] < 1.5 * step
    chances = int(np.count_nonzero(by_one_step[1:-1] & left[:-3] & reached[3:])) if starts.size > 3 else 0
    if repeats < max(_FEWEST, _SHARE * int(np.sum(lengths[certainly])), _CHANCE * chances):
        return np.zeros(signal.size, dtype=np.bool_)
    # the others that were held no longer: at either end of the record or of the range
    others = (left | reached) & (lengths <= lengths[certainly].max())
    held = np.repeat(certainly | others, lengths)
    held[starts] = False
    return held


def least_step(signal: Array) -> float:
    """Step of a sensor, or least distance between two levels that differ by more than printed digits do."""
    step = quantisation_step(signal)
    if step is not None:
        return step
    levels = np.unique(signal)
    apart = np.diff(levels)
    apart = apart[apart > _SAME * np.ptp(levels)]
    return float(apart.min()) if apart.size else 0.0
