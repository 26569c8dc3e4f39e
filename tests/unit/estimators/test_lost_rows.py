"""Rows that are lost here and there: a record says as much less, and looks like behind no filter."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.signal import cheby1, lfilter

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
FRICTION = 0.3
NOISE = {"displacement": 1e-4, "velocity": 1e-3}


def decay(quantity: str, rate: float, duration: float, seed: int, amplitude: float = 0.0147) -> xr.DataArray:
    return fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=amplitude,
        duration=duration,
        sampling_rate=rate,
        noise_sd=NOISE[quantity],
        seed=seed,
        quantity=quantity,
    )


def without(record: xr.DataArray, share: float, seed: int) -> xr.DataArray:
    kept = np.random.default_rng(seed).random(record.size) >= share
    kept[[0, -1]] = True
    return record[kept]


def error_and_width(record: xr.DataArray) -> tuple[float, float]:
    found = fb.estimate(record, SYSTEM)
    assert found.to_dict()["noise"]["filter"] is None
    low, high = found.friction.interval(0.98)
    assert low < FRICTION < high
    return abs(found.friction.mean() - FRICTION), high - low


@pytest.mark.parametrize(
    ("quantity", "seed", "share"),
    [("displacement", 204, 0.2), ("velocity", 204, 0.1), ("displacement", 205, 0.3)],
)
def test_lost_rows_are_no_filter(quantity: str, seed: int, share: float) -> None:
    """Interpolated noise passed for exponential smoothing: 9 % high, and thirty times as wide."""
    record = decay(quantity, 50.0, 12.0, seed)
    _, whole = error_and_width(record)
    error, width = error_and_width(without(record, share, seed))
    assert error < 0.01 * FRICTION
    assert width < 3.0 * whole


@pytest.mark.parametrize(("quantity", "share"), [("displacement", 0.4), ("velocity", 0.1)])
def test_a_mean_is_of_what_a_block_holds(quantity: str, share: float) -> None:
    """A block of fifteen was lost with one row of it: friction was known a hundred times worse, or not."""
    record = decay(quantity, 5000.0, 8.0, 7)
    _, whole = error_and_width(record)
    _, width = error_and_width(without(record, share, 3))
    assert width == pytest.approx(whole / np.sqrt(1.0 - share), rel=0.15)


def test_a_filter_is_seen_in_a_record_that_lost_five_rows() -> None:
    """Of a kind that is not listed: friction was .15 N, by a random force."""
    record = decay("displacement", 50.0, 14.0, 11, amplitude=0.02)
    lead = np.full(200, record.values[0])
    behind = lfilter(*cheby1(3, 1.0, 0.12), np.concatenate([lead, record.values]))[220:]
    whole = fb.make_record(record["time"].values[20:], behind, "displacement")
    kept = np.ones(behind.size, np.bool_)
    kept[[100, 250, 300, 401, 402]] = False
    friction, known = (fb.estimate(each, SYSTEM).friction for each in (whole[kept], whole))
    assert abs(friction.mean() - known.mean()) < 0.05 * FRICTION
    low, high = friction.interval(0.98)
    assert low < FRICTION < high
    assert friction.std() < 1.3 * known.std()


def test_dropouts_are_not_measured_without_a_random_force_either() -> None:
    record = decay("displacement", 100.0, 20.0, 5)
    values = record.values.copy()
    rng = np.random.default_rng(3)
    for start in range(60, 1900, 40):
        values[start : start + rng.integers(3, 9)] = 0.02
    with pytest.warns(fb.RecordWarning, match="dropout"):
        found = fb.estimate(record.copy(data=values), SYSTEM, random_force="none")
    clean = fb.estimate(record, SYSTEM, random_force="none")
    assert found.friction.std() > 1.03 * clean.friction.std()
