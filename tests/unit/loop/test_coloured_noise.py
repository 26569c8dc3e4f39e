"""Noise of the sensor that is coloured, white or absent, as a closed loop takes it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import cumulative_trapezoid
from scipy.signal import butter, filtfilt, lfilter, sosfiltfilt

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.estimators.noise.noise_level import noise_floor, sensor_noise
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.record_fit import fit_first_part, fit_random_force
from friction_bayes.loop.noise.correlated_noise import Colour
from friction_bayes.statespace.coloured_noise import with_missing_drawn

FRICTION = 0.07
OFFERED = ["viscous_damping", "friction_drift", "cubic_stiffness", "random_force"]
"""Few of the catalogue, so that a test takes a second."""


def decay(**changed: object) -> xr.DataArray:
    usual = {"initial_displacement": 0.02, "duration": 20.0, "noise_sd": 1e-4, "seed": 1}
    return slow_decay(**usual | changed)


def test_a_record_behind_a_filter_without_lag_is_adequate() -> None:
    record = decay(duration=12.0)
    record = record.copy(data=filtfilt(*butter(4, 0.2), record.values))
    report = fb.close_loop([record], SYSTEM, seed=1, effects=OFFERED)
    assert report.noise["model"] == "ar"
    assert report.verdict == "adequate"
    friction = report.friction_after
    assert friction["mean"] == pytest.approx(FRICTION, rel=0.02)
    low, high = friction["interval90"]
    assert low < FRICTION < high


def test_noise_that_is_differentiated_twice_is_coloured() -> None:
    """The filter shows by its noise; taken as white that makes intervals ten times as wide."""
    record = decay(duration=16.0, noise_sd=2e-6)
    step = float(record.time[1] - record.time[0])
    twice = np.gradient(np.gradient(record.values, step), step)
    record = fb.make_record(record.time.values, twice, "acceleration", synthetic=True)
    report = fb.close_loop([record], SYSTEM, seed=1, effects=OFFERED)
    assert report.noise["filter"]["name"] == "a derivative by slopes over 3 samples, twice"
    assert report.noise["order"] > 1
    assert report.verdict == "adequate"
    low, high = report.friction_after["interval90"]
    assert low < FRICTION < high < 1.01 * FRICTION


@pytest.mark.parametrize(
    ("mass", "stiffness", "friction", "amplitude", "duration", "noise_sd", "seed"),
    [(2.0, 1400.0, 0.3, 0.006, 1.5, 8e-3, 5), (1.57, 656.0, 0.175, 0.007, 2.3, 6e-3, 3)],
)
def test_no_law_is_found_in_accelerations_that_were_integrated(
    mass: float,
    stiffness: float,
    friction: float,
    amplitude: float,
    duration: float,
    noise_sd: float,
    seed: int,
) -> None:
    """Their noise wanders, the stronger the slower, and a high pass of no lag rings at either end."""
    system = fb.Oscillator(mass=mass, stiffness=stiffness)
    record = fb.simulate(
        system,
        friction=friction,
        initial_displacement=amplitude,
        duration=duration,
        sampling_rate=500.0,
        quantity="acceleration",
        noise_sd=noise_sd,
        seed=seed,
    )
    time, biased = record.time.values, record.values + 0.1
    velocity = cumulative_trapezoid(biased - biased.mean(), time, initial=0.0)
    velocity = sosfiltfilt(butter(2, 0.5, "high", fs=500.0, output="sos"), velocity)
    report = fb.close_loop([fb.make_record(time, velocity, "velocity", synthetic=True)], system, seed=1)
    low, high = report.friction_after["interval90"]
    assert low < friction < high < 1.05 * low


def test_the_first_part_has_the_noise_that_was_asked_for() -> None:
    record = decay(duration=12.0)
    record = record.copy(data=filtfilt(*butter(4, 0.2), record.values))
    (segment,) = cut_records([record], SYSTEM)
    whole = fit_random_force(segment, SYSTEM, ["viscous_damping"], noise="white")
    assert whole is not None
    first = fit_first_part(whole, ["viscous_damping"], int(0.7 * segment.moving))
    assert first is not None
    assert not isinstance(first.record.error, Colour)
    assert first.record.noise == "white"


def test_white_noise_is_not_taken_for_coloured() -> None:
    assert fb.close_loop([decay()], SYSTEM, seed=1).noise["model"] == "white"


def test_a_random_force_in_an_acceleration_is_not_taken_for_colour() -> None:
    record = decay(quantity="acceleration", noise_sd=1e-3, effects=fluctuating_friction())
    report = fb.close_loop([record], SYSTEM, seed=1, effects=OFFERED)
    assert report.noise["model"] != "ar"
    assert report.random_force is not None
    assert report.random_force["probability"] > 0.95


@pytest.mark.parametrize("noise", ["white", "ar"])
def test_noise_that_is_asked_for_is_that_of_the_report(noise: str) -> None:
    record = decay(duration=5.0)
    record = record.copy(data=filtfilt(*butter(4, 0.2), record.values))
    report = fb.close_loop([record], SYSTEM, seed=1, noise=noise, effects=[], random_force="none")
    assert report.noise["model"] == noise


@pytest.mark.parametrize("left_out", ["gap", "clipped"])
def test_the_level_near_the_motion_is_the_same_where_samples_are_left_out(
    left_out: str, rng: np.random.Generator
) -> None:
    """Without their places, the octave above the motion's would lie higher."""
    angle = 2.0 * np.pi / 60.0 * np.arange(6000)
    residual = lfilter([1.0], [1.0, -0.8], rng.standard_normal(angle.size))
    gap = (np.arange(angle.size) > 2000) & (np.arange(angle.size) < 5000)
    used = ~gap if left_out == "gap" else np.abs(np.cos(angle)) < 0.7

    def levels(residual: np.ndarray, angle: np.ndarray) -> list[float]:
        floor = noise_floor(residual, angle, 0, 5)
        # behind a filter that takes half of the noise near the motion
        return [floor, sensor_noise(residual, angle, 5, 0.5 * floor, even=True).coloured_floor]

    whole = with_missing_drawn(residual, used)
    assert levels(whole, angle) == pytest.approx(levels(residual, angle), rel=0.2)
