"""Records behind a filter: with gaps, and refused for no saturation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import friction_bayes as fb
from filtered_decays import SYSTEM, decay, filtered
from friction_bayes.core.arrays import Array
from friction_bayes.estimators.result import force_notes


def test_a_gap_takes_away_neither_colours_nor_free_corners() -> None:
    whole, lacking = (fb.estimate(filtered("acceleration", 12.0, lost=lost), SYSTEM) for lost in (0, 28))
    assert lacking.friction.mean() == pytest.approx(whole.friction.mean(), rel=2e-4)
    # not the sd: filters that are not listed, of a probability of 1e-3, are evaluated without gaps alone
    low, high = lacking.friction.interval(0.9)
    assert high - low == pytest.approx(np.diff(whole.friction.interval(0.9))[0], rel=0.1)
    assert lacking.fit.noise_model == "coloured"
    assert lacking.random_force.probability < 0.01


@pytest.mark.parametrize(("rate", "random_force"), [(200.0, "auto"), (1000.0, "none")])
def test_rounded_corners_of_an_acceleration_are_no_saturation(rate: float, random_force: str) -> None:
    """It is refused, or not, before accounts of the noise are compared."""
    found = fb.estimate(filtered("acceleration", 8.0, rate=rate), SYSTEM, random_force=random_force)
    assert found.friction.mean() == pytest.approx(1.0, rel=0.02)


def check_recognised(record: xr.DataArray, name: str, *, width: float) -> None:
    """That a filter of a name that begins so is found, and friction of 1 N known to a 95 % interval."""
    found = fb.estimate(record, SYSTEM)
    assert found.fit.filter is not None
    assert found.fit.filter.name.startswith(name)
    low, high = found.friction.interval(0.95)
    assert low < 1.0 < high
    assert high - low < width


@pytest.mark.parametrize(
    ("made", "order", "rate"),
    [
        (lambda x, step: np.gradient(x, step), 1, 50.0),
        (lambda x, step: np.diff(x) / step, 1, 50.0),
        (lambda x, step: signal.savgol_filter(x, 9, 2, deriv=1, delta=step), 1, 50.0),
        (lambda x, step: np.gradient(np.gradient(x, step), step), 2, 100.0),
    ],
    ids=["gradient", "differences", "slopes", "gradient twice"],
)
def test_a_derivative_of_positions_is_recognised(
    made: Callable[[Array, float], Array], order: int, rate: float
) -> None:
    """Of 31 positions a period np.gradient shows 1 % less of the motion, slopes over nine samples 10 %."""
    positions = decay(rate=rate)
    derived = made(positions.values, 1.0 / rate)
    inside = slice(10, -10)
    record = fb.make_record(
        positions["time"].values[: derived.size][inside],
        derived[inside],
        ["displacement", "velocity", "acceleration"][order],
    )
    check_recognised(record, "a derivative by", width=0.01)


@pytest.mark.parametrize("corner", [0.05, 0.1])
def test_the_coupling_of_an_accelerometer_is_found_to_what_its_signal_shows(corner: float) -> None:
    """It takes 0.1 or 0.5 % of the motion: neighbouring corners of a list differ by a tenth of that."""
    motion = decay("acceleration", rate=2000.0, start=0.08, duration=16.0)
    b, a = signal.butter(1, corner * SYSTEM.natural_frequency / (2.0 * np.pi), "high", fs=2000.0)
    values = signal.lfilter(b, a, motion.values)[1000::10]
    found = fb.estimate(fb.make_record(motion["time"].values[1000::10], values, "acceleration"), SYSTEM)
    assert found.friction.mean() == pytest.approx(1.0, abs=0.2 * corner**2)
    assert found.fit.filter is not None


@pytest.mark.parametrize("zero_phase", [True, False], ids=["both ways", "one way"])
def test_a_decimated_record_is_recognised(zero_phase: bool) -> None:
    """It shows 1 or 0.5 % less of the motion, and 20 dB less of the noise in the last tenth of its band."""
    motion = decay(rate=600.0, start=0.08)
    values = signal.decimate(motion.values, 6, zero_phase=zero_phase)[10:-10]
    record = fb.make_record(motion["time"].values[::6][10:-10], values, "displacement")
    check_recognised(record, "decimation", width=0.005)


@pytest.mark.parametrize("seed", [5, 7])
def test_noise_that_is_white_but_for_a_silent_end_of_its_band_is_coloured(seed: int) -> None:
    """Near the motion's frequency it is as strong as white noise, for which no spectra would be compared."""
    motion = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.08,
        duration=7.0,
        sampling_rate=500.0,
        noise_sd=2e-5,
        seed=seed,
    )
    values = signal.decimate(motion.values, 5)[10:-10]
    found = fb.estimate(fb.make_record(motion["time"].values[::5][10:-10], values, "displacement"), SYSTEM)
    assert found.fit.filter is not None


def test_what_is_silent_above_its_filter_is_no_white_noise() -> None:
    """Noise is then taken to be as strong as near the motion's frequency, and nothing is said against it."""
    found = fb.estimate(filtered("displacement", 16.0, order=4, rate=1000.0, both=True), SYSTEM)
    assert found.fit.noise_model == "coloured"
    assert not any("not white noise" in note for note in found.notes)
    assert found.friction.mean() == pytest.approx(1.0, rel=1e-3)


def test_a_force_next_to_coloured_noise_is_not_doubted_for_residuals_of_its_colour() -> None:
    clean = decay("acceleration", duration=2.8, rate=250.0)
    drawn = np.random.default_rng(4).normal(0.0, 0.06, clean.size)
    noisy = clean.copy(data=clean.values + signal.lfilter([0.44], [1.0, -0.9], drawn))
    found = fb.estimate(noisy, SYSTEM)
    best = max((each for each in found.fit.accounts if each.forced), key=lambda each: each.probability)
    assert best.weaker_above
    assert not best.innovations.white
    likely = replace(found.fit, random_force=replace(found.fit.random_force, probability=0.9))
    notes = force_notes(found.decay, likely)
    assert any("can pass for such a force" in note for note in notes)
    assert not any("not white noise" in note for note in notes)
