"""The clock of a record: what counts as increasing and evenly spaced time stamps, decided here alone."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import TIME_UNITS
from friction_bayes.core.unit_spelling import plain_unit

__all__ = [
    "GAP",
    "LONGEST_BRIDGED_GAP",
    "LONGEST_GAP_IN_PERIODS",
    "LOST",
    "check_clock",
    "check_gaps",
    "check_in_seconds",
    "check_time_unit",
    "gaps",
    "in_time_unit",
    "is_even",
    "place_of_sample",
    "sampling_interval",
]

JITTER_RMS = 0.01
"""Largest root mean square distance of the time stamps from an even grid, in sampling intervals.

A sample taken ``e`` intervals late is wrong by ``2 pi e / s`` of the amplitude at ``s`` samples per period:
one per cent is 47 dB below the signal even at ten samples per period, far under any sensor noise that
matters here. Rounded time stamps (1e-3 of an interval) pass easily.
"""

JITTER_PEAK = 0.05
"""Largest distance of a single time stamp from the grid, in intervals; beyond it the sample is an outlier."""

GAP = 1.5
"""An interval longer than this many typical ones lost at least one sample."""

LONGEST_BRIDGED_GAP = 3.0
"""Up to this many typical intervals may lie between samples, however few a period has."""

LONGEST_GAP_IN_PERIODS = 1.0
"""Nor do longer ones up to so many periods: a decay is sought on an oscillation through the samples next to
it, and the fit goes by the samples alone. A declared frequency may be off by a tenth, and half cycles would
be miscounted after two periods and a half; an envelope, which takes what is filled in for samples, covers
less after two.
"""

LOST = (
    "remove those rows, the times need not be even; where they last a period or more, cut the record there, "
    "by --start or --end"
)
"""What to do about samples that hold no value."""

BEGINS_ANEW = 0.01
"""Share of the time gone by that is left where a clock falls back to its beginning."""

LEAST_SHARE = 0.1
"""Of the samples, that the part before a fault of the clock has where it is worth a proposal."""

_HOUR = 3600.0

LEAST_IN_ORDER = 10
"""Time stamps that rise one after the other, of which a recording has as many; rows out of order have not."""


def sampling_interval(record: xr.DataArray) -> float:
    """Return the mean sampling interval [s]."""
    time = record["time"].values
    return float((time[-1] - time[0]) / (time.size - 1))


def place_of_sample(index: int, time: Array, rows: Indices | None = None, unit: str = "s") -> str:
    """Return how a message points at a sample, its time [s] in the unit of the file."""
    place = f"sample {index + 1}" if rows is None else f"row {rows[index]}"
    return f"{place} (t = {_in_unit(time[index], unit)})"


def _in_unit(seconds: float, unit: str) -> str:
    return f"{seconds / TIME_UNITS[unit]:.9g} {unit}"


def in_time_unit(place: str, what: str, unit: str) -> str:
    """Return a unit of time in its one spelling.

    Raises
    ------
    InputError
        If ``what`` is in no unit of time.
    """
    plain = plain_unit(unit)
    if plain not in TIME_UNITS:
        raise InputError(place, f"{what} is in {unit}", f"give it in one of {', '.join(TIME_UNITS)}")
    return plain


def check_in_seconds(name: str, time: xr.DataArray) -> None:
    """Refuse times that are in another unit than seconds, by their attribute ``units``.

    Raises
    ------
    InputError
        Naming it.
    """
    unit = time.attrs.get("units", "s")
    if plain_unit(unit) != "s":
        raise InputError(name, f"time in unit {unit!r} instead of s", "convert it to seconds, units s")


def check_clock(name: str, time: Array, rows: Indices | None = None, unit: str = "s") -> None:
    """Refuse time stamps that do not increase.

    Parameters
    ----------
    name : str
        What the message calls the record.
    time : ndarray, shape (n,)
        Time stamps [s].
    rows : ndarray of int, shape (n,), optional
        Row of each sample in the file it came from, for messages.
    unit : str
        Unit of the times in that file.

    Raises
    ------
    InputError
        If time runs backwards or a stamp is doubled.
    """
    wrong = np.flatnonzero(np.diff(time) <= 0.0) + 1
    if wrong.size:
        raise _backwards(name, time, wrong, rows, unit)


def gaps(time: Array, natural_frequency: float) -> Indices:
    """Return the samples after which too much is missing to be bridged, ascending.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Rising time stamps [s].
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s].
    """
    intervals = np.diff(time)
    # stamps may be off by as much as on an even grid, if only by their rounding
    few = (LONGEST_BRIDGED_GAP + JITTER_PEAK) * float(np.median(intervals))
    return np.flatnonzero(intervals > max(few, LONGEST_GAP_IN_PERIODS * 2.0 * math.pi / natural_frequency))


def check_gaps(record: xr.DataArray, natural_frequency: float) -> None:
    """Refuse time stamps between which too much is missing to be bridged.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s].

    Raises
    ------
    InputError
        Naming the longest gap.
    """
    time: Array = record["time"].values
    if not gaps(time, natural_frequency).size:
        return
    intervals, period = np.diff(time), 2.0 * math.pi / natural_frequency
    longest = int(intervals.argmax())
    before, after = time[longest : longest + 2]
    raise InputError(
        str(record.attrs.get("name", "record")),
        f"gap of {intervals[longest]:.6g} s after {place_of_sample(longest, time)}: "
        f"{intervals[longest] / period:.3g} periods of the declared {natural_frequency:.4g} rad/s, and the "
        f"typical interval is {np.median(intervals):.6g} s",
        f"take the part before it, --end {before:.9g}, or after it, --start {after:.9g}; where the recording "
        "pauses between releases, one by --decay N or each by --decay all",
    )


def _backwards(name: str, time: Array, wrong: Indices, rows: Indices | None, unit: str) -> InputError:
    """Return what to say of times that do not increase at the samples ``wrong``."""
    k = int(wrong[0])
    place, before = place_of_sample(k, time, rows, unit), _in_unit(time[k - 1], unit)
    mended = time + _HOUR * (np.arange(time.size) >= k)
    little = GAP * float(np.median(np.diff(time)))
    # a clock that begins anew after an hour falls back to where it began
    if wrong.size == 1 and 0.0 < mended[k] - mended[k - 1] <= little < abs(time[k] - time[0]):
        rate = (time.size - 1) / (mended[-1] - mended[0])
        return InputError(
            name,
            f"the clock jumps back by an hour at {place}, after {before}, as where summer time ends",
            f"give --sampling-rate {rate:.6g}"
            if is_even(mended)
            else "add an hour to the times from there on",
        )
    begins_anew = time[wrong] - time[0] < BEGINS_ANEW * (time[wrong - 1] - time[0])
    if begins_anew.all() and np.diff(wrong, prepend=0, append=time.size).min() >= LEAST_IN_ORDER:
        return InputError(
            name,
            f"the clock begins anew at {place}, after {before}: there seem to be "
            f"{wrong.size + 1} recordings, one behind the other",
            "split the file there and give each by itself",
        )
    if np.all(time[wrong] == time[wrong - 1]):
        return _doubled(name, time, place)
    what = "is doubled" if time[k] == time[k - 1] else f"runs backwards from {before}"
    doubled = bool(np.any(time[wrong] == time[wrong - 1]))
    return InputError(
        name,
        f"time {what} at {place}",
        "sort the rows; "
        + ("of doubled stamps --duplicates first or mean takes one sample; " if doubled else "")
        + "if the clock is at fault, give --sampling-rate"
        + (
            f", or take the part before it, --end {time[k - 1]:.9g}"
            if k >= max(LEAST_IN_ORDER, LEAST_SHARE * time.size)
            else ""
        ),
    )


def _doubled(name: str, time: Array, place: str) -> InputError:
    """Return what to say of times that rise but for some that two samples or more have in common."""
    first = np.flatnonzero(np.diff(time, prepend=-np.inf))
    at_each = float(np.median(np.diff(first, append=time.size)))
    if at_each <= 2.0:
        return InputError(
            name,
            f"time is doubled at {place}",
            "--duplicates first or mean takes one sample of each time; if the clock is at fault, give "
            "--sampling-rate",
        )
    # of 333 Hz in hundredths of a second there are three or four at each; the first has fewer
    rate = f" {np.polyfit(time[first[1:]], first[1:], 1)[0]:.6g}" if first.size > 2 else ""
    return InputError(
        name,
        f"time is doubled at {place}: {time.size} samples have {first.size} times",
        f"give --sampling-rate{rate}",
    )


def is_even(time: Array) -> bool:
    """Whether time stamps [s], shape (n,), lie on an even grid, but for :data:`JITTER_RMS` or so."""
    index = np.arange(time.size) - 0.5 * (time.size - 1)
    step = float(index @ time / (index @ index))
    distance = (time - time.mean() - step * index) / step
    return bool(np.sqrt(np.mean(distance**2)) <= JITTER_RMS and np.abs(distance).max() <= JITTER_PEAK)


def check_time_unit(record: xr.DataArray, natural_frequency: float) -> None:
    """Refuse times that the declared frequency shows to be in another unit than seconds.

    They are where they leave less than two samples a period, or less than a period in all, and in that unit
    neither.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s].

    Raises
    ------
    InputError
        Naming that unit, or those.
    """
    per_period = 2.0 * math.pi / (natural_frequency * sampling_interval(record))
    fitting = [unit for unit, seconds in TIME_UNITS.items() if 2.0 < per_period / seconds < record.size]
    if not fitting or "s" in fitting:
        return
    raise InputError(
        str(record.attrs.get("name", "record")),
        f"{per_period:.3g} samples a period of the declared {natural_frequency:.4g} rad/s, "
        + " or ".join(f"{per_period / TIME_UNITS[unit]:.4g} with the times in {unit}" for unit in fitting)
        + f": time in {' or '.join(fitting)}?",
        f"name the time column time_{' or time_'.join(fitting)} in a header line, give --sampling-rate, or "
        "check mass and stiffness",
    )
