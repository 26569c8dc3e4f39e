"""A record: an ``xarray.DataArray`` over ``time`` that says what was measured, in which unit."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity, quantity_named, to_si

__all__ = [
    "make_record",
    "record_name",
    "record_quantity",
    "resample_record",
    "sampling_interval",
    "validate_record",
]

MINIMUM_SAMPLES = 8
"""One more than the whole-signal model has unknowns: amplitude, friction, rest, frequency, phase, noise."""

JITTER_RMS = 0.01
"""Largest root mean square distance of the time stamps from an even grid, in sampling intervals.

A sample taken ``e`` intervals late is wrong by ``2 pi e / s`` of the amplitude at ``s`` samples per period:
one per cent is 47 dB below the signal even at ten samples per period, far under any sensor noise that
matters here. Rounded time stamps (1e-3 of an interval) pass by far.
"""

JITTER_PEAK = 0.05
"""Largest distance of a single time stamp from the grid, in intervals; beyond it the sample is an outlier."""

GAP = 1.5
"""An interval longer than this many typical ones lost at least one sample."""

LONGEST_RESAMPLED_GAP = 3.0
"""Resampling bridges up to this many typical intervals; more would be invention, not interpolation."""


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
        Sample times [s].
    values : array_like, shape (n,)
        The signal, in ``unit``.
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
    kind = quantity_named(quantity)
    factor, si_unit = to_si(kind, kind.unit if unit is None else unit)
    clock, signal = _numbers(name, "time", time), _numbers(name, "signal", values)
    if clock.size != signal.size:
        raise InputError(
            name, f"{clock.size} times for {signal.size} samples", "give one time for each sample"
        )
    stamps = xr.Variable("time", clock, {"units": "s", "standard_name": "time"})
    return xr.DataArray(
        signal * factor,
        dims=("time",),
        coords={"time": stamps},
        name=kind.name,
        attrs={"quantity": kind.name, "units": si_unit, "name": name, **attrs},
    )


def record_quantity(record: xr.DataArray) -> Quantity:
    """Return the :class:`~friction_bayes.core.quantities.Quantity` a record holds."""
    return quantity_named(
        record.attrs.get("quantity", ""), place=f"{record_name(record)}: attribute quantity"
    )


def record_name(record: xr.DataArray) -> str:
    """Return what messages call the record."""
    return str(record.attrs.get("name", "record"))


def sampling_interval(record: xr.DataArray) -> float:
    """Return the mean sampling interval [s]; of a validated record, *the* interval."""
    time = record["time"].values
    return float((time[-1] - time[0]) / (time.size - 1))


def validate_record(
    record: xr.DataArray, *, rows: Indices | None = None, evenly: bool = True
) -> xr.DataArray:
    """Return the record unchanged, refusing what no estimator could use.

    Parameters
    ----------
    record : xarray.DataArray
        As :func:`make_record` builds it.
    rows : ndarray of int, shape (n,), optional
        Row of each sample in the file it came from, for messages.
    evenly : bool
        Whether sampling must be uniform within the jitter tolerance.

    Raises
    ------
    InputError
        If it is not a one-dimensional record over ``time`` in a known quantity and unit; has too few
        samples, a NaN or infinity, a constant signal, time stamps that run backwards or are doubled,
        a gap, or uneven sampling.
    """
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
                f"{what} is {array[bad[0]]} at {_where(bad[0], time, rows)}{others}",
                "remove or repair those samples, or cut the record there",
            )
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        raise InputError(
            name,
            f"the signal is constant at {values[0]:g} {unit}",
            "give a record of a free decay: nothing moves in this one",
        )
    _check_clock(name, time, rows, evenly)
    return record


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
        As :func:`validate_record`, or if a gap is too long to bridge.
    """
    validate_record(record, evenly=False)
    time, values = np.asarray(record["time"].values, dtype=float), np.asarray(record.values, dtype=float)
    intervals = np.diff(time)
    longest, typical = int(intervals.argmax()), float(np.median(intervals))
    if intervals[longest] > LONGEST_RESAMPLED_GAP * typical:
        raise InputError(
            record_name(record),
            f"gap of {intervals[longest]:g} s after {_where(longest, time, None)} is too long to interpolate "
            f"(typical interval {typical:g} s)",
            "cut the record there",
        )
    grid = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / typical) + 1)
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


def _numbers(name: str, what: str, array: ArrayLike) -> Array:
    """Return a one-dimensional float array, refusing anything else."""
    raw = np.asarray(array)
    if raw.dtype.kind not in "fiu" or raw.ndim != 1:
        raise InputError(
            name,
            f"{what} is an array of {raw.dtype} with shape {raw.shape}",
            "give a one-dimensional array of real numbers (time in seconds)",
        )
    return raw.astype(float, copy=False)


def _where(index: int, time: Array, rows: Indices | None) -> str:
    """Return how a message points at a sample."""
    place = f"sample {index + 1}" if rows is None else f"row {rows[index]}"
    return f"{place} (t = {time[index]:.9g} s)"


def _check_clock(name: str, time: Array, rows: Indices | None, evenly: bool) -> None:
    """Refuse time stamps that do not increase and, if asked, those that are not evenly spaced."""
    intervals = np.diff(time)
    wrong = np.flatnonzero(intervals <= 0.0)
    if wrong.size:
        k = int(wrong[0]) + 1
        what = "is doubled" if time[k] == time[k - 1] else f"runs backwards from {time[k - 1]:.9g} s"
        raise InputError(
            name,
            f"time {what} at {_where(k, time, rows)}",
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
            f"gap of {intervals[longest]:.6g} s after {_where(longest, time, rows)} "
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
