"""Detection points T1..Tn: friction and time of each, and where the times come from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, finite_text
from friction_bayes.core.errors import InputError
from friction_bayes.records.record import record_name

__all__ = ["DetectionPoints", "detection_times", "per"]


TIME_ATTRIBUTE = "detection_time"
"""Attribute of a record, or coordinate of a fleet: a number, or a date of ISO 8601."""
COUNTED = "detection points"
"""Unit of time where nothing says when the records were taken: they are counted, evenly spaced."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DetectionPoints:
    """Friction of one machine at its detection points.

    Attributes
    ----------
    times : ndarray, shape (n,)
        When the records were taken, increasing.
    time_unit : str
    friction, sd : ndarray, shape (n,)
        Estimate of each record and its standard deviation, mass and stiffness taken as exact.
    unit : str
        Unit of friction.
    relative_sd : float
        Relative standard deviation of the factor from signal to friction, common to all points.
    """

    times: Array
    time_unit: str
    friction: Array
    sd: Array
    unit: str
    relative_sd: float

    @property
    def span(self) -> float:
        """Time between the first and the last point."""
        return float(self.times[-1] - self.times[0])


def detection_times(
    records: Sequence[xr.DataArray], times: Sequence[Any] | None, unit: str | None
) -> tuple[Array, str, str]:
    """Return when the records were taken, in which unit, and what said so.

    Parameters
    ----------
    records : sequence of xarray.DataArray
        Each may have the attribute ``detection_time`` and, with a number, ``detection_time_units``.
    times : sequence, optional
        One a record, in place of the attributes: numbers in one unit, or dates of ISO 8601.
    unit : str, optional
        Unit of numbers given as ``times``.

    Returns
    -------
    times : ndarray, shape (n,)
    unit : str
        Days from the first record for dates; counted points where nothing says when.
    source : str

    Raises
    ------
    InputError
        If there is not one time a record, they mix numbers and dates, or they do not increase.
    """
    names = [record_name(record) for record in records]
    if times is not None:
        if len(times) != len(records):
            raise InputError("times", f"{len(times)} for {len(records)} records", "give one for each record")
        found, dated = _numbers(times, ["times"] * len(names))
        source, name_of_unit = "given", unit or "unit of the given times"
    else:
        attributes = [record.attrs.get(TIME_ATTRIBUTE) for record in records]
        if all(each is None for each in attributes):
            return np.arange(1.0, len(records) + 1.0), COUNTED, "order of the records"
        for name, each in zip(names, attributes, strict=True):
            if each is None:
                raise InputError(
                    name, f"has no attribute {TIME_ATTRIBUTE}, others have", "give the times of all records"
                )
        found, dated = _numbers(attributes, names)
        units = {str(record.attrs.get(f"{TIME_ATTRIBUTE}_units", "")) for record in records}
        if len(units) > 1:
            raise InputError(
                f"{TIME_ATTRIBUTE}_units", f"differ: {', '.join(sorted(units))}", "use one unit of time"
            )
        source, name_of_unit = f"attribute {TIME_ATTRIBUTE}", units.pop() or f"unit of {TIME_ATTRIBUTE}"
    _refuse_wrong_order(found, names)
    return found, "d" if dated else name_of_unit, source


def per(unit: str, time_unit: str) -> str:
    """Return the unit of something per unit of time: ``N/h``, ``N/(detection points)``."""
    return f"{unit}/{time_unit}" if time_unit.isalpha() else f"{unit}/({time_unit})"


def _refuse_wrong_order(times: Array, names: Sequence[str]) -> None:
    wrong = np.flatnonzero(np.diff(times) <= 0.0)
    if wrong.size:
        k = int(wrong[0]) + 1
        raise InputError(
            names[k],
            f"its time, {times[k]:.9g}, is not after that of {names[k - 1]}, {times[k - 1]:.9g}",
            "give the records in the order they were taken",
        )


def _numbers(values: Sequence[Any], places: Sequence[str]) -> tuple[Array, bool]:
    """Turn all into numbers, or all dates into days from the first."""
    dates = [_date(value) for value in values]
    if all(date is not None for date in dates):
        first = dates[0]
        try:
            days = [(date - first).total_seconds() / 86400.0 for date in dates]  # type: ignore[operator]
        except TypeError:
            raise InputError(
                places[0], "some dates have a time zone, others do not", "give all of them alike"
            ) from None
        return np.array(days), True
    entries = list(zip(values, dates, places, strict=True))
    # first what is neither: a mistyped date must not be taken for a number among dates
    numbers = [
        (finite_text if isinstance(value, str) else finite)(place, value)
        for value, date, place in entries
        if date is None
    ]
    for value, date, place in entries:
        if date is not None:
            raise InputError(place, f"{value!r} is a date among numbers", "give all times alike")
    return np.array(numbers), False


def _date(value: Any) -> datetime | None:
    """Return an ISO 8601 date; None for what is a number or neither."""
    try:
        float(value)
    except (TypeError, ValueError):
        pass
    else:
        return None
    try:
        return datetime.fromisoformat(str(value))
    except ValueError:
        return None
