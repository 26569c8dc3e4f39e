"""Time stamps with few decimals of an even clock."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr
from hypothesis import example, given
from hypothesis import strategies as st

import friction_bayes as fb
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import RecordWarning
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.records.rounded_stamps import with_even_stamps

SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)


def sampled(seed: int) -> xr.DataArray:
    """A decay at 60 Hz, whose stamps have no two decimals."""
    return fb.simulate(
        SYSTEM,
        friction=0.1,
        initial_displacement=0.02,
        duration=8.0,
        sampling_rate=60.0,
        noise_sd=2e-5,
        seed=seed,
    )


def stamped(time: Array) -> Array:
    """The stamps that are used of a record with these."""
    record = fb.make_record(time, np.cos(time), "displacement", synthetic=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)
        return np.asarray(with_even_stamps(record)["time"].values)


@example(rate=20.0, start=0.375, samples=50, decimals=2)
@given(
    rate=st.floats(20.0, 95.0),
    start=st.floats(0.0, 100.0),
    samples=st.integers(50, 800),
    decimals=st.integers(2, 4),
)
def test_they_are_the_even_times_that_were_rounded(
    rate: float, start: float, samples: int, decimals: int
) -> None:
    exact = start + np.arange(samples) / rate
    found = stamped(exact.round(decimals))
    apart = np.diff(found)
    # printed finely enough the stamps are as even as they need be
    assert np.ptp(apart) <= max(1e-9, 2.0 * 10.0**-decimals if 10.0**-decimals * rate < 0.1 else 1e-9)
    assert np.max(np.abs(found - exact)) <= 10.0**-decimals
    assert abs(apart.mean() * rate - 1.0) <= 2.0 * 10.0**-decimals * rate / samples


def test_stamps_that_jitter_stay_as_they_are(rng: np.random.Generator) -> None:
    time = (np.arange(300) / 50.0 + rng.normal(0.0, 0.004, 300)).round(3)
    np.testing.assert_array_equal(stamped(time), time)


@pytest.mark.parametrize(("rate", "decimals"), [(100.0, 2), (1000.0, 3), (50.0, 2)])
@pytest.mark.parametrize("lost", [(140,), (90, 210)])
def test_a_missing_row_is_no_rounding(rate: float, decimals: int, lost: tuple[int, ...]) -> None:
    """Where the interval is the last digit, one that is slightly longer gives the same stamps."""
    time = np.delete(np.arange(300) / rate, lost).round(decimals)
    np.testing.assert_array_equal(stamped(time), time)


@pytest.mark.parametrize(("rate", "decimals"), [(60.0, 2), (29.97, 2), (120.0, 3), (700.0, 3), (850.0, 3)])
@pytest.mark.parametrize("lost", [1, 30, "a stretch"])
def test_rows_are_missing_of_rounded_stamps(
    rate: float, decimals: int, lost: int | str, rng: np.random.Generator
) -> None:
    every = np.arange(600)
    out = rng.choice(every[1:-1], lost, replace=False) if isinstance(lost, int) else every[200:260]
    exact = np.delete(every, out) / rate
    found = stamped(exact.round(decimals))
    assert np.max(np.abs(found - exact)) <= 10.0**-decimals
    apart = np.diff(found) * (every.size - 1) / (found[-1] - found[0])
    np.testing.assert_allclose(apart, np.diff(exact) * rate, atol=1e-6)


def test_friction_of_rounded_stamps_with_rows_missing(seed: int) -> None:
    record = sampled(seed)[np.arange(480) % 17 != 5]
    exact = fb.estimate(record, SYSTEM).friction
    with pytest.warns(RecordWarning, match="rounded from an even clock of 60 Hz"):
        printed = fb.estimate(record.assign_coords(time=record["time"].values.round(2)), SYSTEM).friction
    assert printed.mean() == pytest.approx(exact.mean(), abs=0.2 * exact.std())
    assert printed.std() == pytest.approx(exact.std(), rel=0.1)


@pytest.mark.parametrize(("rate", "decimals"), [(240.0, 3), (48.0, 2), (59.94, 2)])
@pytest.mark.parametrize("samples", [300, 6000, 60000])
def test_long_records_and_ties_are_recognised(rate: float, decimals: int, samples: int) -> None:
    exact = np.arange(samples) / rate
    np.testing.assert_allclose(stamped(exact.round(decimals)), exact, rtol=0, atol=10.0**-decimals)
    assert np.ptp(np.diff(stamped(exact.round(decimals)))) < 1e-9


def test_a_spreadsheet_with_two_decimals_says_as_much_as_exact_stamps(seed: int) -> None:
    record = sampled(seed)
    rounded = record.assign_coords(time=record["time"].values.round(2))
    exact = fb.estimate(record, SYSTEM).friction
    with pytest.warns(RecordWarning, match="rounded from an even clock of 60 Hz"):
        printed = fb.estimate(rounded, SYSTEM).friction
    assert printed.mean() == pytest.approx(exact.mean(), abs=0.2 * exact.std())
    assert printed.std() == pytest.approx(exact.std(), rel=0.1)


def test_dropouts_of_a_record_with_rounded_stamps_are_set_aside_in_the_loop(seed: int) -> None:
    record = sampled(seed)
    values = record.values.copy()
    for start in (60, 130, 200):
        values[start : start + 4] = values[start]
    exact = record.copy(data=values)
    rounded = exact.assign_coords(time=record["time"].values.round(2))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)
        ignored = [cut_records([each], SYSTEM)[0].ignored.sum() for each in (exact, rounded)]
    assert ignored[0] == ignored[1] >= 4


def test_a_batch_takes_rounded_stamps(seed: int) -> None:
    record = sampled(seed)
    both = xr.concat([record, record], "record")
    exact = fb.estimate_batch(both, SYSTEM)
    with pytest.warns(RecordWarning, match="even clock"):
        printed = fb.estimate_batch(both.assign_coords(time=record["time"].values.round(2)), SYSTEM)
    np.testing.assert_allclose(printed["friction_mean"], exact["friction_mean"], rtol=1e-4)
