"""Logs of an encoder's events: a row only where the count changes, and nothing while it stays."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.records.clock import is_even

__all__ = ["held_counts"]

_SAME_STEP = 0.01
"""By how much of a step counts may differ."""
_PER_PERIOD = 200
"""Samples a period at which counts are read."""


def held_counts(record: xr.DataArray, natural_frequency: float) -> xr.DataArray | None:
    """The last count at even times, as a sensor of that step that is asked all the time.

    The counts entered are late or early by half a step, and where the motion turns none is entered: taken as
    positions they look like a lag of the sensor, and as gaps.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s].

    Returns
    -------
    xarray.DataArray or None
        None of a record that is no such log, which has even time stamps or steps of any size.
    """
    values = np.asarray(record.values, dtype=np.float64)
    time = np.asarray(record["time"].values, dtype=np.float64)
    if not _goes_count_by_count(values) or is_even(time):
        return None
    even = np.arange(time[0], time[-1], 2.0 * math.pi / (natural_frequency * _PER_PERIOD))
    last = np.searchsorted(time, even, side="right") - 1
    return xr.DataArray(
        values[last], coords={"time": ("time", even, record["time"].attrs)}, attrs=record.attrs
    )


def _goes_count_by_count(values: Array) -> bool:
    """Whether each value is one step from the one before, as where an encoder's pulses are stamped."""
    changes = np.abs(np.diff(values))
    return bool(np.all(np.abs(changes - np.median(changes)) < _SAME_STEP * np.median(changes)))
