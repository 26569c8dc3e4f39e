"""Straight lines between the readings of a slow sensor, and what only looks like them."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.errors import RecordWarning
from friction_bayes.records.joined_readings import _printed_finer, joined_readings
from friction_bayes.records.quantisation import quantisation_step
from friction_bayes.records.readings_alone import readings_alone

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)


def decay(rate: float, noise_sd: float = 1e-4) -> np.ndarray:
    record = fb.simulate(
        SYSTEM,
        friction=0.5,
        initial_displacement=0.02,
        duration=5.0,
        sampling_rate=rate,
        noise_sd=noise_sd,
        seed=1,
    )
    return np.asarray(record.values)


def with_lines(values: np.ndarray, every: int, first: int = 0) -> np.ndarray:
    index = np.arange(values.size)
    kept = index[first::every]
    return np.interp(index[first:], kept, values[kept])


@pytest.mark.parametrize("every", [2, 3, 10, 40])
@pytest.mark.parametrize("digits", [None, 6])
def test_what_lies_between_readings_is_found(every: int, digits: int | None) -> None:
    values = with_lines(decay(1000.0), every)
    if digits is not None:
        values = np.round(values, digits)
    found = joined_readings(values)
    np.testing.assert_array_equal(np.flatnonzero(~found), np.arange(0, values.size, every))


def test_a_recording_may_begin_between_two_readings() -> None:
    values = with_lines(decay(1000.0), 10)[3:]
    np.testing.assert_array_equal(np.flatnonzero(~joined_readings(values))[:3], [7, 17, 27])


@pytest.mark.parametrize("noise_sd", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("step", [0.0, 1e-6, 5e-4])
def test_nothing_is_found_in_a_plain_decay(noise_sd: float, step: float) -> None:
    values = decay(500.0, noise_sd)
    if step:
        values = step * np.round(values / step)
    assert not joined_readings(values).any()
    assert not joined_readings(np.r_[np.full(700, values[0]), values]).any()


def test_no_bend_that_printed_digits_may_make_is_ruled_out(rng: np.random.Generator) -> None:
    """Two steps of any sensor that is found, also of values that miss it by a little."""
    found = []
    for _ in range(200):
        levels = np.rint(rng.uniform(3.0, 300.0) * np.sin(0.05 * np.arange(3000)))
        values = levels + rng.choice([0.0, 1e-10, 0.02]) * rng.uniform(-1.0, 1.0, 3000)
        step = quantisation_step(values)
        found.append(step)
        assert step is None or not _printed_finer(values, 2.0 * step)
    assert sum(step is not None for step in found) > 50
    assert _printed_finer(rng.standard_normal(3000), 0.5)


def test_readings_alone_are_said_and_kept_at_their_times() -> None:
    values = with_lines(decay(1000.0), 10)
    record = fb.make_record(np.arange(values.size) / 1000.0, values, "displacement")
    with pytest.warns(RecordWarning, match="straight lines between the others, 100 a second"):
        readings, kept = readings_alone(record, SYSTEM.natural_frequency)
    np.testing.assert_allclose(readings["time"], 0.01 * np.arange(readings.size))
    assert np.count_nonzero(kept) == readings.size


def test_friction_is_that_of_the_readings() -> None:
    """Taken for samples, the lines make friction half a per cent too small (tenth of a period each)."""
    values = with_lines(decay(1000.0), 60)
    record = fb.make_record(np.arange(values.size) / 1000.0, values, "displacement")
    with pytest.warns(RecordWarning, match="straight lines"):
        result = fb.estimate(record, SYSTEM)
    assert abs(result.friction.mean() / 0.5 - 1.0) < 0.002
