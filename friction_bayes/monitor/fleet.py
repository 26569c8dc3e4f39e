"""Monitoring of many machines at once, over the records of all their detection points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import dask
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import positive
from friction_bayes.core.declared_force import ForceFactor, common_factor
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import quantity_named
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.decay.sensor_calibration import force_factors
from friction_bayes.estimators.batch import estimate_batch
from friction_bayes.monitor.points import COUNTED, TIME_ATTRIBUTE, DetectionPoints, per
from friction_bayes.monitor.report import QUANTILES, follow

__all__ = ["fleet_times", "monitor_fleet"]

_STATUS = ("ok", "too_few_points")
"""Meaning of a machine's ``status`` 0, 1."""
_BLOCK = 16
"""Machines followed by one task, at most."""

_TRACKED = ("friction_mean", "friction_sd", "plain_mean", "plain_sd")
_SCALARS = (
    *("discount", "level_mean", "level_sd", "drift_mean", "drift_sd"),
    *("probability_above_threshold", "probability_never_reached"),
)


def monitor_fleet(records: xr.DataArray, system: Oscillator, *, threshold: float | None = None) -> xr.Dataset:
    """Follow the friction of many machines of one kind over their detection points.

    The numbers are those of :func:`monitor_records`, machine by machine, up to rounding. Records are
    estimated by :func:`friction_bayes.estimate_batch`; work is done by Dask, threads unless its
    configuration says otherwise.

    Parameters
    ----------
    records : xarray.DataArray
        Dimensions machine, point and ``time``, the first two of any name and in this order; attributes
        ``quantity`` and ``units``; coordinate ``time`` [s]. A coordinate ``detection_time`` over points, or
        over machines and points, says when records were taken (attribute ``units``); without it points are
        taken as evenly spaced and counted. A lazy array stays on disk until it is needed.
    system : Oscillator
        Mass or inertia, and stiffness, of each machine.
    threshold : float, optional
        Friction at which a machine fails.

    Returns
    -------
    xarray.Dataset
        Over ``machine`` and ``point``: ``estimate_mean``, ``estimate_sd``, ``record_status`` and
        ``record_warnings`` (``status`` and ``warnings`` of :func:`friction_bayes.estimate_batch`) and
        ``friction_mean``, ``friction_sd``, ``plain_mean``, ``plain_sd`` as in
        :meth:`MonitorReport.to_dataset`, nan where a record cannot be used. Over ``machine``: ``status``,
        ``points_used``, ``discount``, ``level``, ``drift``, ``relative_sd_of_factor`` (standard deviation of
        the factor from the signal to a force) and, with a threshold, ``probability_above_threshold``,
        ``probability_never_reached`` and ``remaining_life`` (over ``quantile``; infinite where the threshold
        is never reached with so much probability).

    Raises
    ------
    InputError
        If the array has other dimensions, fewer than two points, times that do not increase, or an argument
        is wrong.
    """
    check_system(system)
    if threshold is not None:
        positive("threshold", threshold)
    times, time_unit = fleet_times(records)
    machine, _ = _dimensions(records)
    # the force is not used as it is found record by record, and takes longer with its uncertain factors
    exact = replace(system, mass_sd=0.0, inertia_sd=0.0, stiffness_sd=0.0)
    estimates = estimate_batch(records, exact, random_force="none")
    kind = quantity_named(estimates.attrs["quantity"])
    # of the signal: the factor to a force is common to the points of a machine
    to_signal = estimates["frequency"] ** kind.order
    for name in ("mean", "sd"):
        estimates[f"coefficient_{name}"] = to_signal * estimates[f"friction_over_stiffness_{name}"]
    known = {"time_unit": time_unit, "unit": estimates["friction_mean"].attrs["units"]}
    factors_of = partial(force_factors, system, kind, estimates["rest_position"].attrs["units"])
    needed = estimates[
        ["coefficient_mean", "coefficient_sd", "frequency", "frequency_sd", "status", "warnings"]
    ]
    follow_block = dask.delayed(_follow_block)
    parts = dask.compute(
        *(
            follow_block(times[each], needed.isel({machine: each}), factors_of, threshold, known)
            for each in _blocks(records.chunksizes.get(machine, (records.sizes[machine],)))
        )
    )
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    dataset = _as_dataset(columns, times, known, threshold)
    named = {"machine": records[machine].values} if machine in records.coords else {}
    return dataset.assign_coords(named).assign_attrs(quantity=kind.name)


def fleet_times(records: xr.DataArray) -> tuple[Array, str]:
    """Return the times of the points of every machine, shape (machines, points), and their unit.

    Parameters
    ----------
    records : xarray.DataArray
        As for :func:`monitor_fleet`.

    Raises
    ------
    InputError
        If the dimensions are others, there are fewer than two points, or times do not increase.
    """
    machine, point = _dimensions(records)
    shape = (records.sizes[machine], records.sizes[point])
    if TIME_ATTRIBUTE not in records.coords:
        return np.broadcast_to(np.arange(1.0, shape[1] + 1.0), shape), COUNTED
    coordinate = records.coords[TIME_ATTRIBUTE]
    if not set(coordinate.dims) <= {machine, point} or point not in coordinate.dims:
        raise InputError(
            TIME_ATTRIBUTE, f"dimensions {coordinate.dims}", f"give it over {point}, or {machine} and {point}"
        )
    if coordinate.dtype.kind not in "fiu":
        raise InputError(
            TIME_ATTRIBUTE, f"data type {coordinate.dtype}", "give numbers, with attribute units"
        )
    template = xr.DataArray(np.zeros(shape), dims=(machine, point))
    times = (template + coordinate.drop_vars(list(coordinate.coords))).transpose(machine, point).values
    wrong = np.argwhere(~(np.diff(times, axis=1) > 0.0))
    if wrong.size:
        k, i = wrong[0].tolist()
        raise InputError(
            TIME_ATTRIBUTE,
            f"of machine {k}: {times[k, i + 1]:.9g} at point {i + 1} is not after {times[k, i]:.9g}",
            "order the points by time",
        )
    return times.astype(np.float64), str(coordinate.attrs.get("units", f"unit of {TIME_ATTRIBUTE}"))


def _dimensions(records: xr.DataArray) -> tuple[str, str]:
    others = [str(name) for name in records.dims if name != "time"]
    if "time" not in records.dims or len(others) != 2:
        raise InputError(
            "fleet", f"dimensions {records.dims}", "give (machine, point, time), the last one named time"
        )
    if records.sizes[others[0]] < 1 or records.sizes[others[1]] < 2:
        raise InputError(
            "fleet",
            f"{records.sizes[others[0]]} machines, {records.sizes[others[1]]} detection points",
            "give at least one machine and two points",
        )
    return others[0], others[1]


def _blocks(chunks: Sequence[int]) -> list[slice]:
    """Cut chunks of many machines into blocks of few."""
    sizes = [min(_BLOCK, chunk - i) for chunk in chunks for i in range(0, chunk, _BLOCK)]
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def _follow_block(
    times: Array,
    estimates: xr.Dataset,
    factors_of: Callable[[float, float], tuple[ForceFactor, ...]],
    threshold: float | None,
    known: dict[str, Any],
) -> dict[str, NDArray[Any]]:
    """Follow some machines.

    Times and estimates over (machine, point) in, columns of the dataset out. ``factors_of`` a frequency and
    its standard deviation are the factors from the signal to a force.
    """
    machines, points = times.shape
    mean, sd = (estimates[f"coefficient_{name}"].values.copy() for name in ("mean", "sd"))
    usable = np.isfinite(mean) & np.isfinite(sd)
    relative_sd = np.full((machines,), np.nan)
    for k in np.flatnonzero(usable.any(axis=1)):
        found = (float(np.median(estimates[f"frequency{of}"].values[k, usable[k]])) for of in ("", "_sd"))
        factor, relative_sd[k] = common_factor(factors_of(*found))
        mean[k], sd[k] = factor * mean[k], factor * sd[k]
    columns: dict[str, NDArray[Any]] = {name: np.full((machines, points), np.nan) for name in _TRACKED}
    columns |= {"estimate_mean": mean, "estimate_sd": sd, "relative_sd_of_factor": relative_sd}
    columns |= {f"record_{name}": estimates[name].values for name in ("status", "warnings")}
    columns |= {name: np.full((machines,), np.nan) for name in _SCALARS}
    columns["remaining_life"] = np.full((machines, len(QUANTILES)), np.nan)
    columns["points_used"] = usable.sum(axis=1)
    columns["status"] = (columns["points_used"] < 2).astype(np.int8)
    for k in np.flatnonzero(columns["status"] == 0):
        use = usable[k]
        own = known | {"relative_sd": float(relative_sd[k])}
        report = follow(
            DetectionPoints(times=times[k, use], friction=mean[k, use], sd=sd[k, use], **own), threshold
        )
        tracks = (report.forgetting.mean, report.forgetting.sd, report.plain.mean, report.plain.sd)
        for name, values in zip(_TRACKED, tracks, strict=True):
            columns[name][k, use] = values
        scalars = [report.forgetting.discount, *report.wear.moments("level"), *report.wear.moments("drift")]
        if report.life is not None:
            scalars += [report.life.already, report.life.never]
            columns["remaining_life"][k] = [report.life.ppf(q) for q in QUANTILES]
        for name, value in zip(_SCALARS, scalars, strict=False):
            columns[name][k] = value
    return columns


def _as_dataset(
    columns: dict[str, NDArray[Any]], times: Array, known: dict[str, Any], threshold: float | None
) -> xr.Dataset:
    if threshold is None:
        columns = {
            name: values
            for name, values in columns.items()
            if name not in {"remaining_life", "probability_above_threshold", "probability_never_reached"}
        }
    unit, time_unit = known["unit"], known["time_unit"]
    units = dict.fromkeys(("estimate_mean", "estimate_sd", *_TRACKED, "level_mean", "level_sd"), unit)
    units |= dict.fromkeys(("drift_mean", "drift_sd"), per(unit, time_unit))
    units["remaining_life"] = time_unit
    second = {"remaining_life": "quantile"}
    dataset = xr.Dataset(
        {
            name: (
                ("machine", second.get(name, "point"))[: values.ndim],
                values,
                {"units": units.get(name, "1")},
            )
            for name, values in columns.items()
        },
        coords={
            "detection_time": (("machine", "point"), times, {"units": time_unit}),
            "machine": np.arange(len(times)),
            "point": [f"T{i + 1}" for i in range(times.shape[1])],
        },
    )
    dataset["status"].attrs = {"flag_values": [0, 1], "flag_meanings": " ".join(_STATUS)}
    if threshold is None:
        return dataset
    return dataset.assign_coords(quantile=list(QUANTILES)).assign_attrs(threshold=threshold)
