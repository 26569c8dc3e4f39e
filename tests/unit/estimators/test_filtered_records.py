"""Records behind a filter: with gaps, refused for no saturation, and never a law of other forces."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
NOISE = {"displacement": 2e-5, "velocity": 2e-4, "acceleration": 2e-3}


def filtered(
    quantity: str, corner: float, *, order: int = 2, lost: int = 0, rate: float = 200.0, both: bool = False
) -> xr.DataArray:
    """A decay of 1 N through a Butterworth filter, causal or forward and backward, some samples lost."""
    record = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.05,
        duration=12.0,
        sampling_rate=rate,
        noise_sd=NOISE[quantity],
        seed=3,
        quantity=quantity,
    )
    b, a = signal.butter(order, corner, fs=rate)
    values = (signal.filtfilt if both else signal.lfilter)(b, a, record.values)
    kept = np.ones(values.size, dtype=bool)
    kept[700 : 700 + lost] = False
    return fb.make_record(record["time"].values[kept], values[kept], quantity)


@pytest.mark.parametrize(("quantity", "corner"), [("acceleration", 12.0), ("velocity", 8.0)])
def test_a_gap_takes_away_neither_colours_nor_free_corners(quantity: str, corner: float) -> None:
    whole, lacking = (fb.estimate(filtered(quantity, corner, lost=lost), SYSTEM) for lost in (0, 28))
    assert lacking.friction.mean() == pytest.approx(whole.friction.mean(), rel=2e-4)
    assert lacking.friction.std() == pytest.approx(whole.friction.std(), rel=0.1)
    assert lacking.fit.noise_model == "coloured"
    assert lacking.random_force.probability < 0.01


@pytest.mark.parametrize("rate", [200.0, 1000.0])
def test_rounded_corners_of_an_acceleration_are_no_saturation(rate: float) -> None:
    assert fb.estimate(filtered("acceleration", 8.0, rate=rate), SYSTEM).friction.mean() == pytest.approx(
        1.0, rel=0.02
    )


def test_what_is_silent_above_its_filter_is_no_white_noise() -> None:
    """Noise is then taken to be as strong as near the motion's frequency, and nothing is said against it."""
    found = fb.estimate(filtered("displacement", 16.0, order=4, rate=1000.0, both=True), SYSTEM)
    assert found.fit.noise_model == "coloured"
    assert not any("not white noise" in note for note in found.notes)
    assert found.friction.mean() == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("quantity", "corner", "order", "both", "rate"),
    [
        ("displacement", 8.0, 4, True, 200.0),
        ("velocity", 30.0, 4, True, 250.0),
        ("velocity", 8.0, 2, False, 200.0),
        ("acceleration", 12.0, 2, False, 200.0),
    ],
)
def test_the_loop_sees_a_filter_and_takes_it_for_no_law(
    quantity: str, corner: float, order: int, both: bool, rate: float
) -> None:
    record = filtered(quantity, corner, order=order, rate=rate, both=both)
    report = fb.close_loop([record], SYSTEM, seed=1)
    assert report.verdict == "adequate"
    low, high = report.friction_after["interval90"]
    assert low - 0.005 < 1.0 < high + 0.005
    assert high - low < 0.02
    assert report.noise["filter"]["name"].startswith("a low pass")
    # the rest of the record is forecast as the filter shows it
    assert report.held_out_error["after"] < 1.5 * report.held_out_error["before"]
    assert report.held_out_error["inside90"] > 0.8


def test_the_loop_finds_the_damping_behind_a_filter() -> None:
    record = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.05,
        duration=12.0,
        sampling_rate=200.0,
        noise_sd=NOISE["displacement"],
        seed=3,
        effects={"viscous_damping.damping_ratio": 0.004},
    )
    b, a = signal.butter(2, 12.0, fs=200.0)
    report = fb.close_loop([record.copy(data=signal.lfilter(b, a, record.values))], SYSTEM, seed=1)
    assert report.noise["filter"] is not None
    assert report.candidates[0]["effects"] == ["viscous_damping"]
    low, high = report.friction_after["interval90"]
    assert low < 1.0 < high


def test_a_record_without_a_filter_is_behind_none() -> None:
    record = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.05,
        duration=8.0,
        sampling_rate=200.0,
        noise_sd=NOISE["displacement"],
        seed=3,
        effects={"presliding.displacement": 1e-3},
    )
    assert fb.close_loop([record], SYSTEM, seed=1).noise["filter"] is None
