"""Numbers that start over: an angle read from 0 to 360 degrees, a counter of 16 bits."""

from __future__ import annotations

import math
import warnings

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import RecordWarning

__all__ = ["continued"]

_LEAST_BITS = 8
"""Of a counter."""
_AS_ELSEWHERE = 3.0
"""Times the change of slope of 99 in 100 other samples, that there may be where the numbers start over."""
_LEAST_ELSEWHERE = 20
"""Other samples."""


def continued(values: Array, turn: float | None, record: str) -> Array:
    """Return a signal without the leaps by which its numbers start over, where it goes on smoothly then.

    Parameters
    ----------
    values : ndarray, shape (n,)
        As in the file; returned as they are where their numbers do not start over.
    turn : float, optional
        How many of its units a turn has, of an angle.
    record : str
        What the warning calls it.

    Warns
    -----
    RecordWarning
        Where there are such leaps.
    """
    if values.dtype.kind not in "fiu" or values.size <= _LEAST_ELSEWHERE or not np.all(np.isfinite(values)):
        return values
    span = float(np.ptp(values))
    whole = np.all(values == np.round(values)) and span >= 2.0 ** (_LEAST_BITS - 1)
    bits = math.floor(math.log2(span)) + 1 if whole else 0
    counter = 2.0**bits if bits else None
    for period, like in ((turn, "at a full turn"), (counter, f"of a counter of {bits} bits")):
        if period is None or not 0.5 * period < span <= period:
            continue
        steps = np.diff(values.astype(np.float64))
        over = np.abs(steps) > 0.5 * period
        on = np.cumsum(np.append(0.0, -period * np.sign(steps) * over)) + values
        if over.any() and _goes_on_smoothly(on, over, period):
            warnings.warn(
                f"{record}: the numbers start over every {period:.9g}, as {like}: they are continued, "
                f"{np.count_nonzero(over)} times",
                RecordWarning,
                stacklevel=4,
            )
            return on
    return values


def _goes_on_smoothly(on: Array, over: Mask, period: float) -> bool:
    """Whether the slope changes no more at the steps ``over`` than elsewhere."""
    bends = np.abs(np.diff(on, 2))
    near = over[:-1] | over[1:]
    if np.count_nonzero(~near) < _LEAST_ELSEWHERE:
        return False
    # what is as wild as the leaps themselves looks as smooth with them as without
    most = min(_AS_ELSEWHERE * float(np.quantile(bends[~near], 0.99)), 0.5 * period)
    return bool(bends[near].max() <= most)
