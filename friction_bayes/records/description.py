"""What was understood of a record, in a line."""

from __future__ import annotations

import xarray as xr

from friction_bayes.records.clock import is_even

__all__ = ["what_was_read"]


def what_was_read(record: xr.DataArray) -> str:
    """Say in one line what was understood of a record: its columns and units, samples, rate and times."""
    time = record["time"].values
    rate = (time.size - 1) / (time[-1] - time[0])
    intervals = time[1:] - time[:-1]
    apart = "" if is_even(time) else f", {intervals.min():.4g} to {intervals.max():.4g} s apart"
    span = f"{time[0]:.4g} to {time[-1]:.4g} s"
    return f"{record.attrs['read']}: {time.size} samples{apart}, {rate:.4g} Hz, {span}"
