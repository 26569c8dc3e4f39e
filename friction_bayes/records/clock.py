"""The clock of a record: what counts as increasing and evenly spaced time stamps, decided here alone."""

from __future__ import annotations

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError

__all__ = ["GAP", "LONGEST_RESAMPLED_GAP", "check_clock", "place_of_sample", "sampling_interval"]

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

LONGEST_RESAMPLED_GAP = 3.0
"""Resampling bridges up to this many typical intervals; more would be invention, not interpolation."""


def sampling_interval(record: xr.DataArray) -> float:
    """Return the mean sampling interval [s]; of a validated record, *the* interval."""
    time = record["time"].values
    return float((time[-1] - time[0]) / (time.size - 1))


def place_of_sample(index: int, time: Array, rows: Indices | None = None) -> str:
    """Return how a message points at a sample."""
    place = f"sample {index + 1}" if rows is None else f"row {rows[index]}"
    return f"{place} (t = {time[index]:.9g} s)"


def check_clock(name: str, time: Array, rows: Indices | None = None, *, evenly: bool = True) -> None:
    """Refuse time stamps that do not increase, and those not evenly spaced unless they may be.

    Parameters
    ----------
    name : str
        What the message calls the record.
    time : ndarray, shape (n,)
        Time stamps [s].
    rows : ndarray of int, shape (n,), optional
        Row of each sample in the file it came from, for messages.
    evenly : bool
        Whether the stamps must lie on an even grid, within :data:`JITTER_RMS` and :data:`JITTER_PEAK`.

    Raises
    ------
    InputError
        If time runs backwards or a stamp is doubled; if asked, at a gap or uneven sampling.
    """
    intervals = np.diff(time)
    wrong = np.flatnonzero(intervals <= 0.0)
    if wrong.size:
        k = int(wrong[0]) + 1
        what = "is doubled" if time[k] == time[k - 1] else f"runs backwards from {time[k - 1]:.9g} s"
        raise InputError(
            name,
            f"time {what} at {place_of_sample(k, time, rows)}",
            "sort the rows and remove doubled ones, or give --sampling-rate if the clock is at fault",
        )
    if not evenly:
        return
    typical = float(np.median(intervals))
    longest = int(intervals.argmax())
    if intervals[longest] > GAP * typical and np.mean(intervals > GAP * typical) < 0.05:
        bridgeable = intervals[longest] <= LONGEST_RESAMPLED_GAP * typical
        raise InputError(
            name,
            f"gap of {intervals[longest]:.6g} s after {place_of_sample(longest, time, rows)} "
            f"(typical interval {typical:.6g} s)",
            "cut the record there" + (", or give --resample (resample=True)" if bridgeable else ""),
        )
    index = np.arange(time.size) - 0.5 * (time.size - 1)
    step = float(index @ time / (index @ index))
    distance = (time - time.mean() - step * index) / step
    rms, peak = float(np.sqrt(np.mean(distance**2))), float(np.abs(distance).max())
    if rms > JITTER_RMS or peak > JITTER_PEAK:
        raise InputError(
            name,
            f"sampling is not uniform: intervals {intervals.min():.6g} to {intervals.max():.6g} s, "
            f"time stamps off an even grid by {100 * rms:.2g} % of an interval (rms) and {100 * peak:.2g} % "
            f"(largest), where {100 * JITTER_RMS:g} % and {100 * JITTER_PEAK:g} % pass",
            "give --resample (resample=True), or --sampling-rate if only the stamps are coarse",
        )
