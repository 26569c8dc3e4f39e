"""Records of a batch as one array over records and times, from any accepted type."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.checks import in_unit, positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity, quantity_named
from friction_bayes.records.clock import check_in_seconds, is_even, sampling_interval
from friction_bayes.records.record import seconds_from_first
from friction_bayes.records.rounded_stamps import with_even_stamps

__all__ = ["TIME_LAST", "as_stack"]

TIME_LAST = (
    "give (records, samples), a DataArray with a dimension time, or a DataFrame with one column a record"
)
"""Remedy for an array of another shape."""


def as_stack(
    records: Any, sampling_rate: float | None, quantity: str
) -> tuple[xr.DataArray, Quantity, str, float]:
    """Return records over time last, what they measure, in which unit, and the sampling interval [s].

    Parameters
    ----------
    records : array_like, dask array, xarray.DataArray, pandas.DataFrame or sequence of records
        As :func:`friction_bayes.estimate_batch` takes them.
    sampling_rate : float or None
        Samples a second, where ``records`` does not give it.
    quantity : str
        What was measured, where ``records`` does not name it.

    Raises
    ------
    InputError
        If they are no numbers over records and times, in a unit of the quantity other than SI, or their
        times are missing or uneven.
    """
    stack = _over_time(records, quantity)
    if any(size != size for size in stack.shape):
        raise InputError(
            "records", f"unknown chunk sizes, shape {stack.shape}", "call compute_chunk_sizes() first"
        )
    if not stack.sizes["time"]:
        raise InputError("records", f"shape {stack.shape}", TIME_LAST)
    if stack.dtype.kind not in "fiu":
        raise InputError("records", f"data type {stack.dtype}", "give numbers")
    kind = quantity_named(stack.attrs.get("quantity", quantity))
    unit = str(stack.attrs.get("units", kind.unit))
    if unit != kind.unit and unit not in UNCALIBRATED_UNITS:
        raise InputError("records", f"{kind.name} in unit {unit!r}", f"convert it to {kind.unit}")
    if stack.chunks is not None:
        stack = stack.chunk({"time": -1})
    if sampling_rate is not None:
        return (
            stack,
            kind,
            unit,
            1.0 / positive("sampling_rate", in_unit("sampling_rate", sampling_rate, "1/s")),
        )
    if "time" not in stack.coords:
        raise InputError("sampling_rate", "missing", "give it, or a DataArray with a time coordinate")
    check_in_seconds("records", stack["time"])
    stack = stack.assign_coords(time=np.asarray(seconds_from_first(stack["time"].values), dtype=float))
    stack = with_even_stamps(stack)
    if not is_even(stack["time"].values):
        raise InputError(
            "records", "their times are uneven", "give them to estimate, one by one, or on an even grid"
        )
    return stack, kind, unit, sampling_interval(stack)


def _over_time(records: Any, quantity: str) -> xr.DataArray:
    """Return an array with the dimension time last, after the one of records or several of a DataArray."""
    if isinstance(records, xr.Dataset):
        raise InputError("records", "a Dataset", "give the one of its variables that was measured")
    if hasattr(records, "columns") and hasattr(records, "index"):
        return _of_frame(records)
    if isinstance(records, list | tuple) and any(isinstance(each, xr.DataArray) for each in records):
        return _of_records(records)
    if isinstance(records, xr.DataArray):
        if "time" not in records.dims or records.ndim < 2:
            raise InputError("records", f"dimensions {records.dims}", "give (record, time)")
        stack = records.transpose(..., "time")
        if stack.ndim == 2 and stack.dims[0] != "record":
            stack = stack.rename({stack.dims[0]: "record"})
        return stack
    array = in_unit("records", records, quantity_named(quantity).unit.replace("s2", "s**2"))
    if isinstance(array, np.ma.MaskedArray):
        array = np.ma.filled(array.astype(float), np.nan)
    if not hasattr(array, "dask"):
        try:
            array = np.asarray(array)
        except ValueError:
            raise InputError(
                "records", "are not of one length", "give them to estimate, one by one"
            ) from None
    if array.ndim != 2:
        raise InputError("records", f"shape {array.shape}", TIME_LAST)
    return xr.DataArray(array, dims=("record", "time"))


def _of_frame(frame: Any) -> xr.DataArray:
    """Array of a pandas table: times along the axis with time labels, or along the rows without any."""
    along, across = (label.dtype.kind in "fmM" for label in (frame.index, frame.columns))
    times, names = (frame.columns, frame.index) if across and not along else (frame.index, frame.columns)
    values = frame.to_numpy() if times is frame.columns else frame.to_numpy().T
    stack = xr.DataArray(values, dims=("record", "time"), coords={"record": np.asarray(names)})
    return stack.assign_coords(time=np.asarray(times)) if along or across else stack


def _of_records(records: list[Any] | tuple[Any, ...]) -> xr.DataArray:
    """Records of one quantity and one clock as rows of an array."""
    first = records[0]
    for k, each in enumerate(records):
        alike = (
            isinstance(each, xr.DataArray) and each.dims == ("time",) and each["time"].equals(first["time"])
        )
        if not alike or any(each.attrs.get(key) != first.attrs.get(key) for key in ("quantity", "units")):
            raise InputError(
                f"records[{k}]",
                "differs from the first in its times, quantity or unit",
                "give each to estimate by itself",
            )
    return xr.DataArray(
        np.stack([each.values for each in records]),
        dims=("record", "time"),
        coords={"time": first["time"]},
        attrs=first.attrs,
    )
