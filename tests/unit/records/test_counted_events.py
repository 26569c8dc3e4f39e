"""Logs with a row only where an encoder's count changes."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.counted_events import held_counts

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
STEP = 0.05 / 200.0


def log() -> tuple[xr.DataArray, np.ndarray, np.ndarray]:
    """The events of a decay, and the motion sampled finely."""
    fine = fb.simulate(SYSTEM, friction=0.5, initial_displacement=0.05, duration=20.0, sampling_rate=20_000.0)
    counts = np.floor(fine.values / STEP)
    rows = np.flatnonzero(np.diff(counts)) + 1
    time = fine["time"].values
    return fb.make_record(time[rows], STEP * counts[rows], "displacement"), time, fine.values


def test_counts_are_those_at_even_times() -> None:
    events, time, values = log()
    even = held_counts(events, SYSTEM.natural_frequency)
    assert even is not None
    np.testing.assert_allclose(np.diff(even["time"]), 2.0 * np.pi / (10.0 * 200.0))
    there = np.interp(even["time"], time, values)
    # how far it goes from one fine sample to the next
    late = 0.05 * 10.0 / 20_000.0
    assert np.all((even >= there - STEP - late) & (even <= there + late))
    assert held_counts(even, SYSTEM.natural_frequency) is None


def test_friction_of_such_a_log() -> None:
    """Taken as positions its rows are late by half a step, and at turning points as far as a gap apart."""
    events, _, _ = log()
    with pytest.warns(RecordWarning, match="only where the count changes.* at 5000 even times"):
        estimate = fb.estimate(events, SYSTEM)
    assert estimate.friction.mean() == pytest.approx(0.5, rel=1e-3)
