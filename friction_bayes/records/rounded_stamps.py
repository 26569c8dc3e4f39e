"""Time stamps that an export has rounded: the even clock they are of."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.clock import JITTER_RMS, is_even
from friction_bayes.records.record import record_name

__all__ = ["with_even_stamps"]

_MOST_DECIMALS = 9
_TIES = 1e-6
"""Share of the last digit, to which the clock is found."""
_LOST = math.log(100.0)
"""What a lost row costs in the logarithm of the prior probability, which is 0.01."""


def with_even_stamps(record: xr.DataArray) -> xr.DataArray:
    """A record at the times of the even clock that its stamps are if rounded; as it is where there is none.

    What stamps are off by goes in a pattern, which passes for a line or for jitter. Rows may be missing.

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
    if time.size < 3 or is_even(time):
        return record
    unit = _last_digit(time)
    digits = np.rint((time - time[0]) / unit)
    as_they_are = _surprise(np.diff(digits))
    for ticks in _ticks_of_clocks(digits):
        even = _rounded_from(time, unit, ticks / ticks[-1])
        rounded = _LOST * (float(ticks[-1]) - time.size + 1.0) + 2.0 * math.log(time.size)
        if even is not None and rounded < as_they_are:
            break
    else:
        return record
    warnings.warn(
        f"{record_name(record)}: the time stamps are rounded from an even clock of "
        f"{ticks[-1] / (even[-1] - even[0]):.6g} Hz, whose times are used",
        RecordWarning,
        stacklevel=3,
    )
    return record.assign_coords(time=("time", even, record["time"].attrs))


def _surprise(apart: Array) -> float:
    """Minus the log probability of intervals, in last digits, of no rounded clock.

    They may be whole multiples of the usual one, of which each row may be lost by itself. Others follow each
    other in any order, of a clock that is found with them: of its patterns there are about the square of
    their number, as of those of a rounded clock.
    """
    times = apart / np.median(apart)
    if np.all(times >= 1.0) and np.all(times == np.rint(times)):
        return _LOST * float(np.sum(times - 1.0))
    _, counts = np.unique(apart, return_counts=True)
    return float(2.0 * math.log(apart.size + 1.0) - counts @ np.log(counts / apart.size))


def _last_digit(time: Array) -> float:
    """The decimal that the stamps are rounded to."""
    exact = float(np.spacing(np.float32(np.max(np.abs(time)))))
    decimals = (k for k in range(_MOST_DECIMALS) if np.max(np.abs(time - time.round(k))) <= exact)
    return float(10.0 ** -next(decimals, _MOST_DECIMALS))


def _ticks_of_clocks(digits: Array) -> Iterator[Array]:
    """Which ticks of an even clock stamps may be, in their last digits from the first: every one, or fewer.

    Then its frequency is where they are most alike in phase, which rows that are missing do not change.
    """
    yield np.arange(float(digits.size))
    size = int(digits[-1]) + 1
    # rounding by less is within the jitter of an even clock
    if size * math.sqrt(12.0) * JITTER_RMS > digits.size or size == digits.size:
        return
    stamped = np.zeros(size)
    stamped[digits.astype(np.int64)] = 1.0

    def phasor(cycles: float) -> complex:
        return complex(np.exp(-2j * math.pi * cycles / size * digits).sum())

    most = digits.size - 1 + int(np.argmax(np.abs(np.fft.fft(stamped))[digits.size - 1 :]))
    # whole digits are as much alike in the phase of either
    for near in sorted({most, size - most}):
        cycles = minimize_scalar(lambda f: -abs(phasor(f)), bounds=(near - 1, near + 1), method="bounded").x
        ticks = np.rint(cycles / size * digits + np.angle(phasor(cycles)) / (2.0 * math.pi))
        if np.all(np.diff(ticks) >= 1.0):
            yield ticks - ticks[0]


def _rounded_from(time: Array, unit: float, place: Array) -> Array | None:
    """Times at shares ``place`` of the way, shape (n,), that are these but for rounding to ``unit``."""
    span = float(time[-1] - time[0])
    left = time - time[0] - span * place

    def off(change: float) -> float:
        return float(np.ptp(left - change * unit * place))

    change = float(minimize_scalar(off, bounds=(-1.0, 1.0), method="bounded", options={"xatol": 1e-9}).x)
    widest = unit * (1.0 + _TIES) + 2.0 * float(np.spacing(np.max(np.abs(time))))
    if off(change) > widest:
        return None
    off_by = left - change * unit * place
    # from the first stamp, or as near to it as all allow
    start = min(max(0.0, float(off_by.max()) - 0.5 * widest), float(off_by.min()) + 0.5 * widest)
    return np.asarray(time[0] + start + (span + change * unit) * place)
