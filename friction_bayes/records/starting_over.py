"""Numbers that start over: an angle that a sensor shows within one turn, a counter of so many bits."""

from __future__ import annotations

import math
import warnings

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.clock import GAP
from friction_bayes.records.quantisation import ROUNDING
from friction_bayes.records.record import record_name

__all__ = ["going_on", "ticks_going_on", "while_going_on"]

_TURN = 2.0 * math.pi
_LEAST_BITS = 8
"""Of a counter."""
_TICKS = (2.0**16, 2.0**32)
"""Where counters of ticks start over, as ``micros()`` of a microcontroller does after 72 minutes."""
_LIKE_OTHERS = 2.0
"""Times the largest step elsewhere that one over the border may be: a stray sample is far off."""


def while_going_on(record: xr.DataArray) -> xr.DataArray:
    """A record whose numbers go on where they started over, as from 360 to 0 degrees; others as they are.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.

    Warns
    -----
    RecordWarning
        Where they start over.
    """
    values = going_on(np.asarray(record.values, dtype=np.float64), record.attrs["units"])
    if values is None:
        return record
    warnings.warn(
        f"{record_name(record)}: the numbers start over, as at the end of a turn, and are taken to go on "
        "there",
        RecordWarning,
        stacklevel=3,
    )
    return record.copy(data=values)


def going_on(values: Array, unit: str) -> Array | None:
    """Numbers that go on where they started over, shape (n,); None of those that do not start over.

    No motion that is sampled well goes farther than half a turn from one sample to the next.
    """
    period = _period(values, unit)
    if period is None:
        return None
    inside = _in_one_turn(values, period)
    shown = values[inside]
    steps = np.diff(shown)
    over = np.abs(steps) > 0.5 * period
    # what goes beyond a turn as often is no stray sample
    if not np.count_nonzero(~inside) < np.count_nonzero(over) < steps.size:
        return None
    found = np.unwrap(shown, period=period)
    # one of them may be a release too
    across = np.median(np.abs(np.diff(found)[over]))
    if across > _LIKE_OTHERS * np.max(np.abs(steps[~over])):
        return None
    turns = found - shown
    return np.asarray(values + turns[np.maximum(np.cumsum(inside) - 1, 0)])


def ticks_going_on(ticks: Array) -> Array:
    """Times that go on where the counter that they are read from has started over, shape (n,).

    There the next count is a usual step away on the circle of the counter; the counts as they are otherwise.
    """
    steps = np.diff(ticks)
    for whole in _TICKS:
        over = steps < -0.5 * whole
        if over.any() and ticks.max() < whole:
            found = ticks + whole * np.append(0, np.cumsum(over))
            if np.diff(found)[over].max() <= GAP * np.median(steps):
                return np.asarray(found)
    return ticks


def _in_one_turn(values: Array, period: float) -> Mask:
    """Which numbers lie within the one period that holds most of them, shape (n,)."""
    ascending = np.sort(values)
    most = period * (1.0 + ROUNDING)
    first = ascending[np.argmax(np.searchsorted(ascending, ascending + most) - np.arange(values.size))]
    return np.asarray((values >= first) & (values <= first + most))


def _period(values: Array, unit: str) -> float | None:
    """After how much numbers of a unit may start over."""
    if unit == "rad":
        return _TURN
    if unit == "counts" and np.array_equal(values, np.round(values)):
        bits = math.ceil(math.log2(float(np.ptp(values)) + 1.0))
        return 2.0**bits if bits >= _LEAST_BITS else None
    return None
