"""Accelerometers behind an AC coupling: smooth parts come early, the jumps of dry friction when they do."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import friction_bayes as fb
from friction_bayes.core.system import Oscillator
from friction_bayes.estimators.noise.recording_filters import Through, behind, kinds_for, margin
from friction_bayes.mechanics.coulomb import coulomb_decay

SYSTEM = Oscillator(mass=1.0, stiffness=400.0)
FRICTION, START, OVER = 0.4, 0.03, 8
LARGEST = START * SYSTEM.stiffness / SYSTEM.mass


def acceleration(time: np.ndarray) -> np.ndarray:
    """Of a mass that is released at 0, at rest before."""
    moving = time > 0.0
    motion = coulomb_decay(SYSTEM, FRICTION, START, 0.0, np.append(0.0, time[moving]))
    values = np.zeros(time.size)
    values[moving] = motion.acceleration[1:]
    return values


@cache
def coupled(corner: float, rate: float, noise: float, duration: float = 2.0, seed: int = 1) -> xr.DataArray:
    """What an accelerometer shows whose coupling's corner is relative to the motion's frequency."""
    f0 = SYSTEM.natural_frequency / (2.0 * math.pi)
    time = np.arange(round(-4.0 * rate * OVER), round(duration * rate * OVER)) / (rate * OVER) + 0.1 / rate
    sections = signal.butter(1, corner * f0, "highpass", fs=rate * OVER, output="sos")
    shown = signal.sosfilt(sections, acceleration(time))[::OVER]
    time = time[::OVER]
    values = shown + noise * LARGEST * np.random.default_rng(seed).standard_normal(time.size)
    kept = time > 0.0
    return fb.make_record(time[kept], values[kept], "acceleration", name="coupled")


@pytest.mark.parametrize("corner", [0.04, 0.1, 0.2])
def test_what_jumps_at_known_places_goes_through_as_through_the_analog_filter(corner: float) -> None:
    """But for the samples next to a jump; seen in the middle of a step each is ten times as far off."""
    rate = 500.0
    record = coupled(corner, rate, 0.0)
    time = record["time"].values
    w0 = SYSTEM.natural_frequency
    angle = w0 / rate
    places = (np.arange(1, 1 + int(w0 * time[-1] / math.pi)) * math.pi / w0 - time[0]) * rate
    (kind,) = (each for each in kinds_for(angle, 2) if each.name == "AC coupling")
    filter_ = kind.of(corner * angle)
    assert filter_.in_time
    shown = behind(acceleration(time)[:, None], filter_, places)[:, 0]
    apart, memory = record.values - shown, filter_.memory(time.size)
    inside = slice(margin(angle), time.size - margin(angle))
    # all that may be left is what it remembers of the time before
    apart = apart - memory @ np.linalg.lstsq(memory[inside], apart[inside])[0]
    near = np.min(np.abs(np.subtract.outer(np.arange(time.size), places)), axis=1) < 1.5
    assert np.max(np.abs(apart[inside][~near[inside]])) < 3e-4 * corner * LARGEST


@pytest.mark.parametrize(
    ("corner", "rate", "noise"),
    [(0.03, 1000.0, 1e-4), (0.08, 300.0, 1e-3), (0.15, 200.0, 3e-3), (0.05, 2000.0, 1e-3)],
)
def test_friction_is_right_behind_a_coupling(corner: float, rate: float, noise: float) -> None:
    """Shifted by a share of a step the jumps rang; friction was up to 1 %, 20 widths, off."""
    estimate = fb.estimate(coupled(corner, rate, noise), SYSTEM)
    filter_ = estimate.to_dict()["noise"]["filter"]
    assert filter_ is not None
    assert filter_["name"].startswith("an AC coupling")
    low, high = estimate.friction.interval(0.98)
    assert low < FRICTION < high
    assert high - low < 0.02 * FRICTION


def test_an_accelerometer_without_a_coupling_has_none() -> None:
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=START,
        duration=2.0,
        sampling_rate=500.0,
        quantity="acceleration",
        noise_sd=1e-3 * LARGEST,
        seed=1,
    )
    estimate = fb.estimate(record, SYSTEM)
    assert estimate.to_dict()["noise"]["filter"] is None
    low, high = estimate.friction.interval(0.98)
    assert low < FRICTION < high < low + 0.01 * FRICTION


def test_the_loop_sees_the_coupling_and_forecasts_behind_it() -> None:
    """What it remembers was in another unit than the forecast."""
    report = fb.close_loop([coupled(0.05, 500.0, 3e-4)], SYSTEM, seed=1)
    assert report.verdict in ("adequate", "explained")
    assert report.noise["filter"]["name"].startswith("an AC coupling")
    low, high = report.friction_after["interval90"]
    assert low - 2e-4 < FRICTION < high + 2e-4
    assert report.held_out_error["inside90"] > 0.7
    assert report.held_out_error["after"] < 1.5 * report.held_out_error["before"]


def test_columns_are_sharp_where_no_filter_sees_between_samples(rng: np.random.Generator) -> None:
    """A filter that is not in time takes columns as they are, wherever they jump."""
    columns = np.cumsum(rng.standard_normal((400, 2)), axis=0)
    (kind,) = (each for each in kinds_for(0.1, 2) if each.name == "Gaussian weights")
    filter_ = kind.of(float(kind.sizes[3]))
    np.testing.assert_array_equal(behind(columns, filter_, np.array([7.4])), Through(columns)(filter_))
