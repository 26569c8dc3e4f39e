"""A record: an ``xarray.DataArray`` over ``time`` that says what was measured, in which unit."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.checks import finite, in_unit
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity, quantity_named, to_si
from friction_bayes.core.text import time_span
from friction_bayes.records.clock import LOST, check_clock, check_in_seconds, place_of_sample

__all__ = [
    "DUPLICATES",
    "MINIMUM_SAMPLES",
    "make_record",
    "record_name",
    "record_quantity",
    "seconds_from_first",
    "validate_record",
    "with_values",
    "within",
    "without_doubled_times",
]

MINIMUM_SAMPLES = 8
"""Two more than the unknowns of a whole signal: amplitude, friction, rest, frequency, phase and noise."""

DUPLICATES = ("first", "mean")
"""What may be taken of samples with one time stamp."""

MOST_AT_ENDS = 0.9
"""Share of samples at the two ends of the range: a sine clipped at a sixth of its amplitude has as many."""


def make_record(
    time: ArrayLike,
    values: ArrayLike,
    quantity: str,
    *,
    unit: str | None = None,
    name: str = "record",
    **attrs: Any,
) -> xr.DataArray:
    """Build a record, in SI units.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times [s], a quantity that converts itself, or dates and time differences of NumPy and pandas,
        which are counted from the first.
    values : array_like, shape (n,)
        The signal, in ``unit``, or a quantity that converts itself, such as one of pint. Samples that a
        masked array masks are left out, with their times.
    quantity : str
        One of :data:`friction_bayes.core.quantities.QUANTITIES`.
    unit : str, optional
        Unit of ``values``; SI when left out. Other known units are converted, uncalibrated ones kept.
    name : str
        What messages and figures call it.
    **attrs
        Further attributes, such as ``synthetic=True``.

    Returns
    -------
    xarray.DataArray
        Dimension ``time`` (attribute ``units`` "s"); attributes ``quantity``, ``units``, ``name``.

    Raises
    ------
    InputError
        If quantity or unit is unknown, or the two arrays are not numbers of one common length.
    """
    if "units" in attrs:
        raise InputError("units", "would be the unit that the record is in", "give unit=, which converts it")
    kind = quantity_named(quantity)
    factor, si_unit = to_si(kind, kind.unit if unit is None else unit)
    if unit is None:
        values = in_unit("values", values, kind.unit.replace("s2", "s**2"))
    elif hasattr(values, "magnitude"):
        raise InputError("unit", f"{unit} is given for values that have a unit", "leave unit out")
    time = in_unit("time", time, "s")
    clock, signal = _numbers(name, "time", seconds_from_first(time)), _numbers(name, "signal", values)
    if clock.size != signal.size:
        raise InputError(
            name, f"{clock.size} times for {signal.size} samples", "give one time for each sample"
        )
    masks = [np.ma.getmaskarray(each) for each in (time, values) if isinstance(each, np.ma.MaskedArray)]
    if masks:
        kept = ~np.logical_or.reduce(masks)
        clock, signal = clock[kept], signal[kept]
    # as they are, and the times as the index that xarray makes of them: it otherwise loads Dask to see
    # whether the arrays are Dask's
    stamps = xr.IndexVariable("time", pd.Index(clock), {"units": "s", "standard_name": "time"}, fastpath=True)
    described = {"quantity": kind.name, "units": si_unit, "name": name, **attrs}
    samples = xr.Variable("time", signal * factor, described, fastpath=True)
    return xr.DataArray(samples, coords={"time": stamps}, name=kind.name)


def record_quantity(record: xr.DataArray) -> Quantity:
    """Return the :class:`~friction_bayes.core.quantities.Quantity` a record holds."""
    return quantity_named(
        record.attrs.get("quantity", ""), place=f"{record_name(record)}: attribute quantity"
    )


def record_name(record: xr.DataArray) -> str:
    """Return what messages call the record."""
    return str(record.attrs.get("name", "record"))


def with_values(record: xr.DataArray, values: Array) -> xr.DataArray:
    """Return the record with other samples in the place of its own.

    Parameters
    ----------
    record : xarray.DataArray
    values : ndarray, shape (n,)
        In the unit of the record.
    """
    # as they are, like in make_record; record.copy(data=values) checks whether they are Dask's
    samples = xr.Variable(record.dims, values, record.attrs, fastpath=True)
    return xr.DataArray(samples, coords=record.coords, name=record.name)


def within(record: xr.DataArray, start: float | None, end: float | None) -> slice:
    """Return the samples from where ``start`` is reached to where ``end`` [s] is; all where neither is given.

    Of a clock that jumps back, either side can thus be taken.

    Raises
    ------
    InputError
        If there is none.
    """
    time = record["time"].values
    if time.size < MINIMUM_SAMPLES:
        return slice(None)
    # half a sample further out, so that the rounding of time stamps cannot lose the first or the last
    half = 0.5 * float(np.median(np.diff(time)))
    for option, limit in (("--start", start), ("--end", end)):
        if limit is not None and not time[0] - half < finite(option, limit) < time.max() + half:
            raise InputError(
                option,
                f"{limit:g} s lies outside {record_name(record)}",
                f"give {time_span(time[0], time.max(), 6)}",
            )
    first, stop = 0, time.size
    if start is not None:
        first = int(np.argmax(time > start - half))
    if end is not None:
        reached = int(np.argmax(time > end - half))
        past = np.abs(time[reached:] - end) >= half
        stop = reached + int(np.argmax(past)) if past.any() else stop
    if stop <= first:
        raise InputError("--end", f"{end:g} s is before --start {start:g} s", "give an end after the start")
    return slice(first, stop)


def without_doubled_times(record: xr.DataArray, how: str) -> tuple[xr.DataArray, Indices]:
    """Return the record with one sample a time stamp, and which sample of each stamp was the first.

    Parameters
    ----------
    record : xarray.DataArray
    how : {"first", "mean"}
        Of the samples that successive equal stamps have, the first or their mean.

    Raises
    ------
    InputError
        If ``how`` is neither.
    """
    if how not in DUPLICATES:
        raise InputError("--duplicates", f"{how!r} is unknown", f"give {' or '.join(DUPLICATES)}")
    time, values = record["time"].values, record.values
    first = np.flatnonzero(np.diff(time, prepend=-np.inf) != 0.0)
    kept = record[first]
    if how == "mean" and first.size:
        kept = with_values(kept, np.add.reduceat(values, first) / np.diff(first, append=time.size))
    return kept, first


def validate_record(
    record: xr.DataArray, *, rows: Indices | None = None, time_unit: str = "s"
) -> xr.DataArray:
    """Return the record unchanged, refusing what no estimator could use.

    Parameters
    ----------
    record : xarray.DataArray
        As :func:`make_record` builds it.
    rows : ndarray of int, shape (n,), optional
        Row of each sample in the file it came from, for messages.
    time_unit : str
        Unit of the times in that file, for messages.

    Raises
    ------
    InputError
        If it is not a one-dimensional record over ``time`` in a known quantity and unit; has too few
        samples, a NaN or infinity, a constant signal or one of two values, time stamps that run backwards or
        are doubled, or a gap.
    """
    if not isinstance(record, xr.DataArray):
        raise InputError(
            "record",
            f"{type(record).__name__} instead of a record, which says what was measured and when",
            "make one with make_record(time, values, quantity), of a table make_record(table.index, "
            "table[column], quantity), or read it with read_record",
        )
    name = record_name(record)
    if record.dims != ("time",) or "time" not in record.coords:
        raise InputError(
            name,
            f"dimensions {record.dims} instead of one, time, with its coordinate",
            "pass one record at a time, built by make_record or read_record",
        )
    kind = record_quantity(record)
    unit = record.attrs.get("units", "")
    if unit != kind.unit and unit not in UNCALIBRATED_UNITS:
        raise InputError(
            name,
            f"{kind.name} in unit {unit!r} instead of {kind.unit}",
            "build the record with make_record, which converts units",
        )
    check_in_seconds(name, record["time"])
    time, values = _numbers(name, "time", record["time"].values), _numbers(name, "signal", record.values)
    if values.size < MINIMUM_SAMPLES:
        raise InputError(
            name, f"{values.size} samples", f"give at least {MINIMUM_SAMPLES}, over three half cycles or more"
        )
    for what, array in (("time", time), ("signal", values)):
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            others = f" and {bad.size - 1} more" if bad.size > 1 else ""
            raise InputError(
                name,
                f"{what} is {array[bad[0]]} at {place_of_sample(bad[0], time, rows, time_unit)}{others}",
                LOST,
            )
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise InputError(
            name,
            f"the signal is constant at {values[0]:g} {unit}",
            "give a record of a free decay: nothing moves in this one",
        )
    at_ends = float(np.mean((values == values.max()) | (values == values.min())))
    if at_ends > MOST_AT_ENDS:
        raise InputError(
            name,
            f"{100.0 * at_ends:.0f} % of the samples are {values.min():g} or {values.max():g} {unit}, "
            "nothing between",
            "give the motion itself: a square wave or a switch shows no amplitude",
        )
    check_clock(name, time, rows, time_unit)
    return record


def _numbers(name: str, what: str, array: ArrayLike) -> Array:
    """Return a one-dimensional float array, refusing anything else."""
    raw = np.asarray(array)
    if raw.dtype.kind == "O" and raw.ndim == 1:
        raw = _from_objects(name, what, raw)
    if raw.dtype.kind not in "fiu" or raw.ndim != 1:
        raise InputError(
            name,
            f"{what} is an array of {raw.dtype} with shape {raw.shape}",
            "give a one-dimensional array of real numbers (time in seconds)",
        )
    return raw.astype(float, copy=False)


def _from_objects(name: str, what: str, raw: NDArray[np.object_]) -> Array:
    """Numbers that are kept as objects, as of a table with a column of mixed kinds."""
    for row, each in enumerate(raw):
        if isinstance(each, bool) or not isinstance(each, Real):
            raise InputError(
                name, f"{what} is {each!r} at row {row}, counted from 0", "give numbers alone: mend that row"
            )
    return raw.astype(float)


def seconds_from_first(time: ArrayLike) -> ArrayLike:
    """Dates and time differences as seconds from the first; anything else as it is."""
    stamps = np.asarray(time)
    if stamps.dtype.kind not in "mM" or stamps.ndim != 1 or not stamps.size:
        return time
    return np.asarray((stamps - stamps[0]) / np.timedelta64(1, "ns")) * 1e-9
