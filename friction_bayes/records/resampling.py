"""Resampling of an unevenly sampled record onto an even grid."""

from __future__ import annotations

import numpy as np
import xarray as xr

from friction_bayes.records.clock import GAP
from friction_bayes.records.record import validate_record

__all__ = ["resample_record"]


def resample_record(record: xr.DataArray) -> xr.DataArray:
    """Interpolate a record onto an even grid over the same time, at the typical interval.

    A cubic spline; between two equal samples the value is kept, so that flat tops of a clipped sensor
    stay recognisable. Interpolation correlates the noise of neighbouring samples.

    Parameters
    ----------
    record : xarray.DataArray
        A valid record but for its uneven sampling.

    Returns
    -------
    xarray.DataArray
        The record, attribute ``resampled`` saying what was done.

    Raises
    ------
    InputError
        As :func:`validate_record`.
    """
    from scipy.interpolate import make_interp_spline

    validate_record(record, evenly=False)
    time, values = np.asarray(record["time"].values, dtype=float), np.asarray(record.values, dtype=float)
    intervals = np.diff(time)
    typical = float(np.median(intervals))
    # the mean where no sample is missing: the median keeps the rounding of the time stamps
    step = float(intervals[intervals <= GAP * typical].mean())
    grid = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / step) + 1)
    # a spline overshoots beside a flat top; nothing beyond the recorded range was seen
    resampled = np.clip(make_interp_spline(time, values, k=3)(grid), values.min(), values.max())
    left = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, time.size - 2)
    flat = values[left] == values[left + 1]
    resampled[flat] = values[left][flat]
    note = (
        f"cubic spline onto {grid.size} samples every {grid[1] - grid[0]:.9g} s; "
        f"intervals were {intervals.min():.6g} to {intervals.max():.6g} s"
    )
    stamps = xr.Variable("time", grid, record["time"].attrs)
    return xr.DataArray(
        resampled, coords={"time": stamps}, name=record.name, attrs={**record.attrs, "resampled": note}
    )
