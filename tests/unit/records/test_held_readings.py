"""Repeats of readings that a slow sensor holds, and what only looks like them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import friction_bayes as fb
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.held_readings import held_readings
from friction_bayes.records.readings_alone import readings_alone

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
FRICTION = 0.5


def decay(rate: float, noise_sd: float = 1e-4, seed: int = 1) -> np.ndarray:
    record = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=0.02,
        duration=5.0,
        sampling_rate=rate,
        noise_sd=noise_sd,
        seed=seed,
    )
    return np.asarray(record.values)


def held(rate: float, updates: float, step: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A decay as a sensor shows it that measures ``updates`` times a second, and which samples are new."""
    fine = decay(1000.0)
    asked = np.arange(0, fine.size, int(1000.0 / rate))
    measured = np.floor(asked / (1000.0 / updates) + 1e-9).astype(int)
    values = fine[np.round(measured * 1000.0 / updates).astype(int)]
    if step:
        values = step * np.round(values / step)
    return values, np.append(True, np.diff(measured) > 0)


@pytest.mark.parametrize(("rate", "updates"), [(100.0, 50.0), (100.0, 40.0), (200.0, 30.0)])
def test_repeats_of_a_slow_sensor_are_found_and_nothing_else(rate: float, updates: float) -> None:
    values, new = held(rate, updates)
    found = held_readings(values)
    assert not (found & new).any()
    # the first reading is reached by no jump, as one that waits for its release, and the last is left by none
    inside = slice(*np.flatnonzero(new)[[1, -1]])
    # near a turning point a reading may differ from the one before by no more than noise does
    assert np.mean(found[inside] == ~new[inside]) > 0.97


def test_a_slow_sensor_with_steps_is_found_where_it_moves_fast() -> None:
    values, new = held(100.0, 40.0, step=5e-4)
    found = held_readings(values)
    assert not (found & new).any()
    assert found.sum() > 0.3 * (~new).sum()


@settings(max_examples=60)
@given(
    rate=st.sampled_from([20.0, 50.0, 100.0, 400.0, 1000.0]),
    step=st.floats(1e-5, 4e-3),
    noise=st.floats(0.0, 3e-3),
    seed=st.integers(0, 2**31),
)
def test_an_encoder_or_a_digitiser_holds_nothing(rate: float, step: float, noise: float, seed: int) -> None:
    """Slow motion repeats a level, and so does noise about one, or an end of the range."""
    values = step * np.floor(decay(rate, noise, seed) / step)
    assert not held_readings(values).any()
    assert not held_readings(np.clip(values, -0.012, 0.009)).any()


def test_a_sensor_at_an_end_of_its_range_holds_nothing() -> None:
    assert not held_readings(np.clip(decay(100.0), -0.012, 0.012)).any()
    assert not held_readings(np.clip(decay(100.0), -1.0, 0.008)).any()


def test_a_record_without_steps_or_repeats_is_left_alone() -> None:
    record = fb.make_record(np.arange(500) / 100.0, decay(100.0), "displacement")
    same, kept = readings_alone(record, SYSTEM.natural_frequency)
    assert same is record
    assert kept.all()


def test_both_commands_say_so_and_count_a_reading_once() -> None:
    values, new = held(100.0, 25.0)
    record = fb.make_record(np.arange(values.size) / 100.0, values, "displacement", name="slow.csv")
    with pytest.warns(RecordWarning, match=r"slow.csv: 3[67]\d of 500 samples repeat .* measures 25 times"):
        estimated = fb.estimate(record, SYSTEM, method="waveform")
    assert abs(estimated.friction.mean() - FRICTION) < 5.0 * estimated.friction.std()
    with pytest.warns(RecordWarning, match="repeat the one before"):
        report = fb.close_loop([record], SYSTEM, seed=1)
    assert report.verdict != "unexplained"
    assert report.fitted["samples"] <= new.sum() + 10
    assert abs(report.friction_after["mean"] - FRICTION) < 4.0 * report.friction_after["sd"]


def test_a_measured_force_is_compared_at_the_samples_that_are_kept() -> None:
    values, _ = held(100.0, 25.0)
    record = fb.make_record(np.arange(values.size) / 100.0, values, "displacement")
    force = FRICTION * np.ones(values.size)
    with pytest.warns(RecordWarning, match="repeat the one before"):
        report = fb.close_loop([record], SYSTEM, seed=1, reference_force=force)
    assert "force" in report.residual


def test_one_reading_that_stands_for_periods_is_no_gap() -> None:
    """No sample is missing from an even file: the sensor hung."""
    values, _ = held(100.0, 25.0)
    values[200:294] = values[200]
    record = fb.make_record(np.arange(values.size) / 100.0, values, "displacement")
    for analyse in (lambda: fb.estimate(record, SYSTEM), lambda: fb.close_loop([record], SYSTEM)):
        with pytest.raises(fb.InputError, match=r"one reading is held for 0\.9\d s.*no sample is missing"):
            analyse()
