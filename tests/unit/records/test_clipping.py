"""Clipping is found where the sensor's range ends, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from decays import written_decay
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.record import make_record

AMPLITUDE, DROP = 0.0147, 7e-5


def decay(rate, duration=20.0, frequency=10.0, drop=DROP):
    """A Coulomb decay from rest, coming to rest when its amplitude is used up."""
    time = np.arange(0.0, duration, 1.0 / rate)
    signal = written_decay(time, AMPLITUDE, drop, frequency)
    stop = np.pi / frequency * np.ceil((AMPLITUDE / drop - 1.0) / 2.0)
    return np.where(time < stop, signal, signal[time < stop][-1])


def quantised(signal, step):
    return np.round(signal / step) * step if step else signal


@pytest.mark.parametrize("rate", [10_000, 1000, 100, 30, 10])
@pytest.mark.parametrize("step", [0.0, 1e-7, 2e-5, 3e-4, 1e-3, 3e-3])
@pytest.mark.parametrize("noise", [0.0, 1e-4, 5e-4])
def test_an_unclipped_decay_is_left_alone(rate, step, noise, rng) -> None:
    signal = decay(rate, duration=5.0 if rate > 1000 else 20.0)
    signal = quantised(signal + noise * rng.standard_normal(signal.size), step)
    assert clipped_fraction(signal) == (0.0, None)


@pytest.mark.parametrize("step", [0.0, 2e-5, 5e-4])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_record_mostly_at_rest_is_left_alone(step, noise, rng) -> None:
    signal = decay(1000, drop=1e-3)
    signal = quantised(signal + noise * rng.standard_normal(signal.size), step)
    assert clipped_fraction(signal) == (0.0, None)


@pytest.mark.parametrize(("step", "noise"), [(0.0, 0.0), (2e-5, 0.0), (2e-5, 1e-5)])
def test_a_hold_before_release_is_not_clipping(step, noise, rng) -> None:
    """With noise of half a step too, of which many runs are at the highest level."""
    signal = decay(1000)
    held = np.concatenate([np.full(700, signal[0]), signal])
    held += noise * rng.standard_normal(held.size)
    assert clipped_fraction(quantised(held, step)) == (0.0, None)


@pytest.mark.parametrize("rate", [1000, 100])
@pytest.mark.parametrize("share", [0.9, 0.7])
@pytest.mark.parametrize("step", [0.0, 6e-7, 2e-5])
@pytest.mark.parametrize("noise", [0.0, 1e-4, 5e-4])
def test_flat_tops_are_found_with_their_level(rate, share, step, noise, rng) -> None:
    signal = decay(rate)
    signal += noise * rng.standard_normal(signal.size)
    limit = quantised(share * AMPLITUDE, step)
    clipped = np.clip(quantised(signal, step), -limit, limit)
    fraction, level = clipped_fraction(clipped)
    assert fraction == pytest.approx(np.mean(np.abs(clipped) >= limit), abs=1e-12)
    assert abs(level) == pytest.approx(limit, rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_sided_clipping_is_found_on_its_side(sign) -> None:
    clipped = sign * np.minimum(decay(1000), 0.01)
    fraction, level = clipped_fraction(clipped)
    assert level == sign * 0.01
    assert fraction == np.mean(clipped == level)


def test_a_single_clipped_peak_is_found() -> None:
    # turning points at 14.7, -12.7, 10.7, -8.7 mm ...: only the second is beyond the range
    clipped = np.maximum(decay(1000, drop=1e-3), -0.0115)
    fraction, level = clipped_fraction(clipped)
    assert level == -0.0115
    assert fraction == np.mean(clipped == level)


def test_noise_of_a_few_steps_that_holds_the_highest_value_by_chance_is_no_clipping(rng) -> None:
    step = 1.7e-6
    signal = quantised(decay(1000) + 3.0 * step * rng.standard_normal(decay(1000).size), step)
    peak = int(np.argmax(signal))
    signal[peak : peak + 3] = signal[peak] + 7.0 * step
    assert clipped_fraction(signal) == (0.0, None)


def test_clipping_survives_a_change_of_unit(rng) -> None:
    time = np.arange(2000) / 100.0 + 0.002 * rng.uniform(-1.0, 1.0, 2000)
    clipped = np.clip(14.7 * np.cos(10.0 * time) * (1.0 - time / 30.0), -10.0, 10.0)
    record = make_record(time, clipped, "displacement", unit="mm")
    assert clipped_fraction(record.values)[0] > 0.1


def test_a_constant_is_no_clipping() -> None:
    assert clipped_fraction(np.ones(50)) == (0.0, None)
