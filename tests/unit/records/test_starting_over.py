"""Angles that a sensor shows within one turn, and counters."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.records.starting_over import going_on

DISC = fb.Oscillator(inertia=0.01, stiffness=0.4)
TURN = 2.0 * math.pi


def angle(release: float, about: float = 0.0, seed: int = 1) -> xr.DataArray:
    """A decay about a zero of the sensor."""
    record = fb.simulate(
        DISC,
        friction=0.02 * release,
        initial_displacement=release,
        duration=6.0,
        sampling_rate=100.0,
        quantity="angle",
        noise_sd=1e-3,
        seed=seed,
    )
    return record.copy(data=record.values + about)


def wrapped(record: xr.DataArray, first: float = 0.0) -> xr.DataArray:
    """What a sensor shows that start over, as at the end of a turn from ``first`` on."""
    return record.copy(data=first + np.mod(record.values - first, TURN))


@given(release=st.floats(0.05, 10.0), about=st.floats(-3.0, 3.0), first=st.sampled_from([0.0, -math.pi]))
def test_it_goes_on_where_it_starts_over(release: float, about: float, first: float) -> None:
    """But for whole turns it is the motion; one that does not start over is as it is."""
    time = np.linspace(0.0, 8.0 * math.pi, 1000)
    motion = release * np.cos(time) + about
    shown = first + np.mod(motion - first, TURN)
    found = going_on(shown, "rad")
    if found is None:
        assert np.max(np.abs(np.diff(shown))) <= math.pi
        found = shown
    assert found - found[0] == pytest.approx(motion - motion[0], abs=1e-9)


@pytest.mark.parametrize("value", [3.5, -3.5, 6.0])
def test_a_stray_sample_is_no_turn(value: float) -> None:
    values = 0.1 * np.cos(np.linspace(0.0, 40.0, 500))
    values[[100, 300]] = value
    assert going_on(values, "rad") is None


@pytest.mark.parametrize("value", [-4.0, 9.0, 100.0])
def test_a_stray_sample_beyond_a_turn_hides_no_turns(value: float) -> None:
    motion = 1.2 * np.cos(np.linspace(0.0, 40.0, 500))
    shown = np.mod(motion, TURN)
    shown[[0, 250]] = value
    found = going_on(shown, "rad")
    assert found is not None
    left = np.delete(found - motion, [0, 250])
    assert left == pytest.approx(np.full(left.size, left[0]), abs=1e-9)


def estimated(record: xr.DataArray) -> fb.Estimate:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        return fb.estimate(record, DISC)


@pytest.mark.parametrize("release", [0.1, 1.2, 8.0])
def test_friction_is_that_of_the_motion(release: float) -> None:
    """Of an estimate, and of a batch; and the loop cuts the same record, which says so."""
    record = angle(release, about=0.3 * release)
    shown = wrapped(record)
    plain, found = estimated(record), estimated(shown)
    assert found.friction.mean() == pytest.approx(plain.friction.mean(), rel=1e-6)
    with pytest.warns(fb.RecordWarning, match="start over, as at the end of a turn"):
        fb.estimate(shown, DISC)
    with pytest.warns(fb.RecordWarning, match="start over, as at the end of a turn"):
        (segment,) = cut_records([shown], DISC)
    assert np.ptp(segment.values) == pytest.approx(np.ptp(record.values), rel=1e-3)


def many(records: Array, time: Array) -> xr.Dataset:
    stack = xr.DataArray(records, dims=("record", "time"), coords={"time": time})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.RecordWarning)
        return fb.estimate_batch(stack, DISC, quantity="angle")


def test_a_batch_goes_on_too_and_marks_which() -> None:
    records = [angle(release, seed=k) for k, release in enumerate((0.5, 1.0, 2.0))]
    time, motion = records[0]["time"].values, np.stack([record.values for record in records])
    shown = np.mod(motion, TURN)
    shown[1] = motion[1]
    plain, found = many(motion, time), many(shown, time)
    assert found["friction_mean"].values == pytest.approx(plain["friction_mean"].values, rel=1e-6)
    place = found["warnings"].attrs["flag_meanings"].split().index("numbers_start_over")
    assert (found["warnings"].values >> place & 1).tolist() == [1, 0, 1]


def test_decays_of_one_recording_are_split_where_it_goes_on() -> None:
    record = angle(1.0)
    twice = np.concatenate([record.values, np.full(150, record.values[-1]), record.values])
    time = 0.01 * np.arange(twice.size)
    shown = fb.make_record(time, np.mod(twice, TURN), "angle")
    with pytest.warns(fb.RecordWarning, match="start over"):
        assert len(fb.split_decays(shown, DISC)) == 2


@pytest.mark.parametrize("bits", [8, 16])
def test_a_counter_goes_on_too(bits: int) -> None:
    """Over its middle or its end; numbers that are no whole ones are none of a counter."""
    time = np.linspace(0.0, 8.0 * math.pi, 2000)
    motion = np.round(0.3 * 2.0**bits * np.cos(time))
    shown = np.mod(motion, 2.0**bits)
    found = going_on(shown, "counts")
    assert found is not None
    assert np.array_equal(found - found[0], motion - motion[0])
    assert going_on(motion, "counts") is None
    assert going_on(shown + 0.5, "counts") is None
    assert going_on(shown, "V") is None
