"""The readings of a sensor that is slower than the clock of its recording, without what was put between."""

from __future__ import annotations

import math
import warnings

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Mask
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.records.clock import gaps, is_even
from friction_bayes.records.counted_events import held_counts
from friction_bayes.records.held_readings import held_readings
from friction_bayes.records.joined_readings import joined_readings
from friction_bayes.records.record import record_name

__all__ = ["readings_alone"]


def readings_alone(record: xr.DataArray, natural_frequency: float) -> tuple[xr.DataArray, Mask]:
    """Return a record without what lies between its readings, and which samples it keeps, saying so.

    Parameters
    ----------
    record : xarray.DataArray
        A record that :func:`~friction_bayes.records.record.validate_record` has passed.
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s].

    Raises
    ------
    InputError
        If one reading is held for so long that nothing is known of the motion meanwhile.

    Warns
    -----
    RecordWarning
        Where rows are the events of a count (:func:`held_counts`), and where readings are held
        (:func:`held_readings`) or joined by straight lines (:func:`joined_readings`).
    """
    counts = held_counts(record, natural_frequency)
    if counts is not None:
        warnings.warn(
            f"{record_name(record)}: there is a row only where the count changes, one step each: the last "
            f"count is taken at {counts.size} even times",
            RecordWarning,
            stacklevel=3,
        )
        return counts, np.ones(counts.size, np.bool_)
    between = held_readings(record.values)
    said = (
        "repeat the one before while the motion goes on, as where a sensor that measures {rate:.3g} times a "
        "second is asked more often: they are left out, and a reading counts when it first shows"
    )
    if not between.any() and is_even(record["time"].values):
        between = joined_readings(record.values)
        said = (
            "lie on straight lines between the others, {rate:.3g} a second, as in an export at a higher rate "
            "than the sensor's: they are left out"
        )
    if not between.any():
        return record, ~between
    fewer = record[~between]
    _check_longest(record, fewer, natural_frequency)
    said = said.format(rate=1.0 / float(np.median(np.diff(fewer["time"].values))))
    warnings.warn(
        f"{record_name(record)}: {np.count_nonzero(between)} of {record.size} samples {said}",
        RecordWarning,
        stacklevel=3,
    )
    return fewer, ~between


def _check_longest(record: xr.DataArray, fewer: xr.DataArray, natural_frequency: float) -> None:
    """Refuse readings so far apart that the motion between them is unknown, though no sample is missing."""
    time = fewer["time"].values
    apart = np.diff(time)
    if gaps(record["time"].values, natural_frequency).size or not gaps(time, natural_frequency).size:
        return
    longest = int(apart.argmax())
    periods = apart[longest] * natural_frequency / (2.0 * math.pi)
    raise InputError(
        record_name(record),
        f"one reading is held for {apart[longest]:.6g} s, {periods:.3g} periods of the declared "
        f"{natural_frequency:.4g} rad/s, from {time[longest]:.6g} s on: no sample is missing, but the sensor "
        "says nothing new",
        f"take the part before it, --end {time[longest]:.9g}, or after it, --start {time[longest + 1]:.9g}",
    )
