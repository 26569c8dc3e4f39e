"""Time stamps that an export has rounded: the even times they are of."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

from friction_bayes.core.arrays import Array
from friction_bayes.records.clock import is_even
from friction_bayes.records.quantisation import ROUNDING

__all__ = ["with_even_stamps"]

_MOST_DECIMALS = 9
_TIES = 1e-3
"""Share of the last digit, to which the step is found."""


def with_even_stamps(record: xr.DataArray) -> xr.DataArray:
    """A record at the even times that its stamps are if rounded; as it is where they are not.

    What stamps are off by goes in a pattern, which passes for a line or for jitter.

    Parameters
    ----------
    record : xarray.DataArray
        A validated record.
    """
    time = np.asarray(record["time"].values, dtype=np.float64)
    if is_even(time):
        return record
    even = _rounded_from(time)
    return record if even is None else record.assign_coords(time=("time", even, record["time"].attrs))


def _rounded_from(time: Array) -> Array | None:
    """Even times, shape (n,), that are these with as few decimals as they have; None where none are."""
    span = float(time[-1] - time[0])
    decimals = (k for k in range(_MOST_DECIMALS) if np.allclose(time, time.round(k), 0.0, ROUNDING * span))
    unit = 10.0 ** -next(decimals, _MOST_DECIMALS)
    index = np.arange(time.size, dtype=np.float64)

    def off(step: float) -> float:
        return float(np.ptp(time - step * index))

    least, most = (span - unit) / index[-1], (span + unit) / index[-1]
    step = float(
        minimize_scalar(off, bounds=(least, most), method="bounded", options={"xatol": 1e-12 * most}).x
    )
    # halves go either way
    if off(step) > unit * (1.0 + _TIES):
        return None
    left = time - step * index
    return 0.5 * float(left.min() + left.max()) + step * index
