"""Time stamps that an export has rounded: the even clock they are of."""

from __future__ import annotations

import math
import warnings

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.clock import is_even
from friction_bayes.records.record import record_name

__all__ = ["with_even_stamps"]

_MOST_DECIMALS = 9
_TIES = 1e-6
"""Share of the last digit, to which the clock is found."""
_LOG_LOST = math.log(0.01)
"""Of the prior probability that a row is lost."""


def with_even_stamps(record: xr.DataArray) -> xr.DataArray:
    """A record at the times of the even clock that its stamps are if rounded; as it is where there is none.

    What stamps are off by goes in a pattern, which passes for a line or for jitter.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record, or several at the same times.

    Warns
    -----
    RecordWarning
        Where the clock takes the place of the stamps.
    """
    time = np.asarray(record["time"].values, dtype=np.float64)
    if time.size < 3 or is_even(time) or _rows_are_lost(np.diff(time)):
        return record
    even = _rounded_from(time)
    if even is None:
        return record
    warnings.warn(
        f"{record_name(record)}: the time stamps are rounded from an even clock of "
        f"{1.0 / (even[1] - even[0]):.6g} Hz, whose times are used",
        RecordWarning,
        stacklevel=3,
    )
    return record.assign_coords(time=("time", even, record["time"].attrs))


def _rows_are_lost(apart: Array) -> bool:
    """Whether intervals that are whole multiples of one rather lack rows than are rounded from a longer one.

    Of an even clock about the square of their number of patterns can be; every row may be lost by itself.
    """
    usual = float(np.median(apart))
    times = np.rint(apart / usual)
    whole = bool(np.all((times >= 1.0) & (np.abs(apart - times * usual) < 1e-3 * usual)))
    return whole and float(np.sum(times - 1.0)) * _LOG_LOST > -2.0 * math.log(apart.size)


def _rounded_from(time: Array) -> Array | None:
    """An even clock, shape (n,), that gives these with as few decimals as they have; None without one."""
    last = float(np.max(np.abs(time)))
    exact = float(np.spacing(np.float32(last)))
    decimals = (k for k in range(_MOST_DECIMALS) if np.max(np.abs(time - time.round(k))) <= exact)
    unit = 10.0 ** -next(decimals, _MOST_DECIMALS)
    span, place = float(time[-1] - time[0]), np.linspace(0.0, 1.0, time.size)
    left = time - time[0] - span * place

    def off(change: float) -> float:
        return float(np.ptp(left - change * unit * place))

    change = float(minimize_scalar(off, bounds=(-1.0, 1.0), method="bounded", options={"xatol": 1e-9}).x)
    widest = unit * (1.0 + _TIES) + 2.0 * float(np.spacing(last))
    if off(change) > widest:
        return None
    off_by = left - change * unit * place
    # from the first stamp, or as near to it as all allow
    start = min(max(0.0, float(off_by.max()) - 0.5 * widest), float(off_by.min()) + 0.5 * widest)
    return np.asarray(time[0] + start + (span + change * unit) * place)
