"""Monitoring of one machine from the records of its detection points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.declared_force import common_factor
from friction_bayes.core.errors import InputError, of_each
from friction_bayes.core.system import Oscillator, check_system
from friction_bayes.decay.sensor_calibration import force_factors
from friction_bayes.estimators.estimate import estimate
from friction_bayes.estimators.result import Estimate
from friction_bayes.monitor.points import DetectionPoints, detection_times
from friction_bayes.monitor.report import MonitorReport, follow
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.record import record_name

__all__ = ["monitor_records"]


def monitor_records(
    records: Sequence[xr.DataArray],
    system: Oscillator,
    *,
    threshold: float | None = None,
    times: Sequence[Any] | None = None,
    time_unit: str | None = None,
) -> MonitorReport:
    """Follow the friction of a machine over records in the order they were taken, T1, T2, ... Tn.

    Each record is estimated by ``waveform``. The posterior after one point is the prior of the next, whole
    and discounted; a wear model of all points gives the remaining life.

    Parameters
    ----------
    records : sequence of xarray.DataArray
        At least two, of one quantity and unit. The attribute ``detection_time`` of each, a number (unit in
        ``detection_time_units``) or a date, says when it was taken.
    system : Oscillator
        Mass or inertia, and stiffness.
    threshold : float, optional
        Friction at which the machine fails; without one there is no remaining life in the report.
    times : sequence, optional
        When the records were taken, in place of their attributes: numbers, or dates of ISO 8601. With
        neither the points are taken as evenly spaced and counted.
    time_unit : str, optional
        Unit of numbers given as ``times``.

    Returns
    -------
    MonitorReport

    Raises
    ------
    InputError
        If there are fewer than two records, they hold different quantities or units, one of them cannot be
        used, their times do not increase, or the threshold is not a positive number.
    """
    check_system(system)
    if len(records) < 2:
        raise InputError(
            "records", f"{len(records)} given", "give at least two, in the order they were taken"
        )
    first = records[0]
    for record in records[1:]:
        for key in ("quantity", "units"):
            if record.attrs.get(key) != first.attrs.get(key):
                raise InputError(
                    record_name(record),
                    f"{key} {record.attrs.get(key)!r}, that of {record_name(first)} is "
                    f"{first.attrs.get(key)!r}",
                    "give records of the same sensor",
                )
    found, unit, source = detection_times(records, times, time_unit)
    estimates = of_each(lambda record: estimate(record, system, random_force="none"), records)
    first_decay = estimates[0].decay
    # what mass and stiffness are is common to all points, and so is the frequency
    frequency, frequency_sd = (
        float(np.median([getattr(each, name) for each in estimates]))
        for name in ("frequency", "frequency_sd")
    )
    common = common_factor(
        force_factors(system, first_decay.quantity, first_decay.unit, frequency, frequency_sd)
    )
    scale = common.factor / estimates[0].force_factor
    points = DetectionPoints(
        times=found,
        time_unit=unit,
        friction=scale * np.array([float(each.friction_as_declared.mean()) for each in estimates]),
        sd=scale * np.array([_spread(each) for each in estimates]),
        unit=estimates[0].friction_unit,
        relative_sd=common.relative_sd,
    )
    return follow(
        points,
        threshold,
        acquisition=[_acquired(record) for record in records],
        manipulation=[_manipulated(each) for each in estimates],
        times_from=source,
    )


def _spread(found: Estimate) -> float:
    """Standard deviation of the friction with mass and stiffness exact, refusing a record without one."""
    sd = float(found.friction_as_declared.std())
    if not np.isfinite(sd):
        raise InputError(found.decay.name, "too few samples for a standard deviation", "give a longer record")
    return sd


def _acquired(record: xr.DataArray) -> dict[str, Any]:
    return {
        "record": record_name(record),
        "quantity": record.attrs["quantity"],
        "unit": record.attrs["units"],
        "samples": record.size,
        "sampling_rate": 1.0 / sampling_interval(record),
        "synthetic": bool(record.attrs.get("synthetic", False)),
    }


def _manipulated(found: Estimate) -> dict[str, Any]:
    fields = found.to_dict()
    return {key: fields[key] for key in ("friction", "frequency", "noise_sd", "amplitudes", "notes")}
