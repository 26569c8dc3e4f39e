"""Monitoring of many machines at once, over the records of all their detection points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import dask
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import positive
from friction_bayes.core.declared_force import declared_forces
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, quantity_named
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.decay.sensor_calibration import force_factor
from friction_bayes.estimators.batch import estimate_batch
from friction_bayes.monitor.points import COUNTED, TIME_ATTRIBUTE, DetectionPoints, per
from friction_bayes.monitor.report import QUANTILES, follow
from friction_bayes.monitor.resumable_run import Columns, compute_parts

__all__ = ["STATUS", "FleetWork", "fleet_work", "monitor_fleet"]

STATUS = ("ok", "too_few_points")
"""Meaning of a machine's ``status`` 0, 1."""
_BLOCK = 16
"""Machines estimated and followed by one task, at most."""

_TRACKED = ("friction_mean", "friction_sd", "plain_mean", "plain_sd")
_SCALARS = (
    *("discount", "level_mean", "level_sd", "drift_mean", "drift_sd"),
    *("probability_above_threshold", "probability_never_reached"),
)


@dataclass(frozen=True, eq=False)
class FleetWork:
    """Monitoring of a fleet, cut into independent tasks.

    Attributes
    ----------
    tasks : sequence of dask.delayed.Delayed
        Each gives the columns of some machines as arrays by name.
    times : ndarray, shape (machines, points)
    machine_names : ndarray, shape (machines,), or None
    quantity : str
    known : dict
        What all machines have in common: units, relative sd of the factor from signal to friction.
    threshold : float or None
    """

    tasks: Sequence[Any]
    times: Array
    machine_names: NDArray[Any] | None
    quantity: str
    known: dict[str, Any]
    threshold: float | None

    def resume(self, folder: Path, *, note: Callable[[str], None]) -> xr.Dataset:
        """Return the dataset of :func:`monitor_fleet`, each part kept in ``folder`` as soon as it is done.

        Parameters
        ----------
        folder : Path
            Of :func:`friction_bayes.monitor.resumable_run.parts_folder`; parts that it holds are read back.
        note : callable
            Called with a sentence where parts are read back.
        """
        return self.assemble(compute_parts(self.tasks, folder, note=note))

    def assemble(self, parts: Sequence[Columns]) -> xr.Dataset:
        """Return the dataset of :func:`monitor_fleet` from what the tasks gave, in their order."""
        columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        dataset = _as_dataset(columns, self.times, self.known, self.threshold)
        named = {} if self.machine_names is None else {"machine": self.machine_names}
        return dataset.assign_coords(named).assign_attrs(quantity=self.quantity)


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
        Over ``machine`` and ``point``: ``estimate_mean``, ``estimate_sd``, ``record_status`` (see
        :data:`friction_bayes.estimators.batch.STATUS`) and ``friction_mean``, ``friction_sd``,
        ``plain_mean``, ``plain_sd`` as in :meth:`MonitorReport.to_dataset`, nan where a record cannot be
        used. Over ``machine``: ``status``, ``points_used``, ``discount``, ``level``, ``drift`` and, with a
        threshold, ``probability_above_threshold``, ``probability_never_reached`` and ``remaining_life`` (over
        ``quantile``; infinite where the threshold is never reached with so much probability).

    Raises
    ------
    InputError
        If the array has other dimensions, fewer than two points, times that do not increase, or an argument
        is wrong.
    """
    work = fleet_work(records, system, threshold=threshold)
    return work.assemble(dask.compute(*work.tasks))


def fleet_work(records: xr.DataArray, system: Oscillator, *, threshold: float | None = None) -> FleetWork:
    """Cut :func:`monitor_fleet` into tasks, its arguments checked, for a caller that keeps what is done.

    Parameters
    ----------
    records, system, threshold
        As in :func:`monitor_fleet`.

    Raises
    ------
    InputError
        As in :func:`monitor_fleet`.
    """
    check_system(system)
    if threshold is not None:
        positive("threshold", threshold)
    machine, point = _dimensions(records)
    points = records.sizes[point]
    times, time_unit = _times(records, machine, point)
    # mass and stiffness are common to all points: their spread comes in at the threshold
    exact = replace(system, mass_sd=0.0, inertia_sd=0.0, stiffness_sd=0.0)
    ordered, blocks = _in_blocks(records.transpose(machine, point, "time"))
    estimates = estimate_batch(_one_a_row(ordered), exact, random_force="none", judge=False)
    kind = quantity_named(estimates.attrs["quantity"])
    unit = estimates["friction_mean"].attrs["units"]
    factors = declared_forces(system, kind, system.natural_frequency, disagree=False)
    relative_sd = 0.0 if unit in UNCALIBRATED_UNITS else factors[0].relative_sd
    if system.trust is None:
        # at the declared mass and stiffness, whatever the frequency found says of them
        factor = force_factor(system, kind, unit) * estimates["frequency"] ** kind.order
        for name in ("mean", "sd"):
            estimates[f"friction_{name}"] = factor * estimates[f"friction_over_stiffness_{name}"]
    known = {"time_unit": time_unit, "unit": unit, "relative_sd": relative_sd}
    needed = estimates[["friction_mean", "friction_sd", "status"]]
    rows = [slice(each.start * points, each.stop * points) for each in blocks]
    follow_block = dask.delayed(_follow_block)
    return FleetWork(
        tasks=[
            follow_block(times[each], needed.isel(record=row), threshold, known)
            for each, row in zip(blocks, rows, strict=True)
        ],
        times=times,
        machine_names=records.coords[machine].values if machine in records.coords else None,
        quantity=kind.name,
        known=known,
        threshold=threshold,
    )


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


def _times(records: xr.DataArray, machine: str, point: str) -> tuple[Array, str]:
    """Times of the points of every machine, shape (machines, points), and their unit."""
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


def _in_blocks(ordered: xr.DataArray) -> tuple[xr.DataArray, list[slice]]:
    """Cut chunks of many machines into blocks of few, all points and times together; return both."""
    machine, point, _ = ordered.dims
    chunks = ordered.chunksizes.get(machine, (ordered.sizes[machine],))
    sizes = [min(_BLOCK, chunk - i) for chunk in chunks for i in range(0, chunk, _BLOCK)]
    if ordered.chunks is not None:
        ordered = ordered.chunk({machine: tuple(sizes), point: -1, "time": -1})
    ends = np.cumsum(sizes).tolist()
    return ordered, [slice(end - size, end) for end, size in zip(ends, sizes, strict=True)]


def _one_a_row(ordered: xr.DataArray) -> xr.DataArray:
    rows = ordered.data.reshape((-1, ordered.sizes["time"]))
    if "time" not in ordered.coords:
        raise InputError("fleet", "has no coordinate time", "add the sample times in seconds")
    clock = {"time": ordered.coords["time"].values}
    return xr.DataArray(rows, dims=("record", "time"), coords=clock, attrs=ordered.attrs)


def _follow_block(
    times: Array, estimates: xr.Dataset, threshold: float | None, known: dict[str, Any]
) -> Columns:
    """Follow some machines.

    Times of shape (machines, points) and estimates of as many records in, columns of the dataset out.
    """
    machines, points = times.shape
    mean, sd, record_status = (
        estimates[name].values.reshape(times.shape) for name in ("friction_mean", "friction_sd", "status")
    )
    columns: Columns = {name: np.full((machines, points), np.nan) for name in _TRACKED}
    columns |= {"estimate_mean": mean, "estimate_sd": sd, "record_status": record_status}
    columns |= {name: np.full((machines,), np.nan) for name in _SCALARS}
    columns["remaining_life"] = np.full((machines, len(QUANTILES)), np.nan)
    usable = np.isfinite(mean) & np.isfinite(sd)
    columns["points_used"] = usable.sum(axis=1)
    columns["status"] = (columns["points_used"] < 2).astype(np.int8)
    for k in np.flatnonzero(columns["status"] == 0):
        use = usable[k]
        report = follow(
            DetectionPoints(times=times[k, use], friction=mean[k, use], sd=sd[k, use], **known), threshold
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
        attrs={"relative_sd_of_factor": known["relative_sd"]},
    )
    dataset["status"].attrs = {"flag_values": [0, 1], "flag_meanings": " ".join(STATUS)}
    if threshold is None:
        return dataset
    return dataset.assign_coords(quantile=list(QUANTILES)).assign_attrs(threshold=threshold)
