"""What was understood of a record, in a line."""

from __future__ import annotations

import xarray as xr

from friction_bayes.core.text import time_span
from friction_bayes.records.clock import is_even

__all__ = ["what_was_read"]


def what_was_read(record: xr.DataArray) -> str:
    """Say in one line what was understood of a record: its columns and units, samples, rate and times."""
    time = record["time"].values
    rate = (time.size - 1) / (time[-1] - time[0])
    intervals = time[1:] - time[:-1]
    apart = "" if is_even(time) else f", {intervals.min():.4g} to {intervals.max():.4g} s apart"
    span = time_span(time[0], time[-1])
    return f"{record.attrs['read']}: {time.size} samples{apart}, {rate:.4g} Hz, {span}"
