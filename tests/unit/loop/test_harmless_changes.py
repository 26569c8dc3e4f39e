"""What changes next to nothing of a record changes next to nothing of what is said of it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import friction_bayes as fb
from decays import SYSTEM, slow_decay
from friction_bayes.decay.spectral_lines import decaying_lines, steady_lines
from friction_bayes.loop.data.prepared_record import Segment, cut_records
from friction_bayes.loop.infer.finer_columns import line_search
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.loop.mixture.candidates import candidates_of
from friction_bayes.loop.noise.correlated_noise import SensorError
from friction_bayes.statespace.force_grid import integrate_force
from friction_bayes.statespace.problem import Problem
from loop_options import loop_options
from unsteady_decays import ERROR, correlated_record, fitted

LAST_DIGITS = 1e-12
"""Share of each value."""


def with_other_last_digits(record: xr.DataArray, rng: np.random.Generator) -> xr.DataArray:
    return record.copy(data=record.values * (1.0 + LAST_DIGITS * rng.standard_normal(record.size)))


def log_odds(record: xr.DataArray) -> float:
    """Of Stribeck friction against Coulomb friction alone."""
    offered = ("stribeck_friction", "viscous_damping", "asymmetric_friction", "friction_drift")
    (segment,) = cut_records([record], SYSTEM)
    found = candidates_of((segment,), SYSTEM, loop_options(offered), np.random.default_rng(1))
    probability = dict(zip(found.sets, found.probabilities, strict=True))
    return math.log(probability[frozenset({"stribeck_friction"})] / probability[frozenset()])


@pytest.mark.parametrize("seed", [3, 10])
def test_an_evidence_does_not_hang_on_the_last_digits(seed: int, rng: np.random.Generator) -> None:
    record = slow_decay(seed=seed)
    found = [log_odds(with_other_last_digits(record, rng)) for _ in range(3)]
    assert np.ptp(found) < 0.15


def with_lines(samples: int, rng: np.random.Generator, *lines: float) -> tuple[np.ndarray, Segment]:
    """White noise with lines [Hz] in samples of a decay of 1.59 Hz."""
    (segment,) = cut_records([slow_decay(seed=1)], SYSTEM)
    time = segment.decay.step * np.arange(samples)
    noise = rng.standard_normal(samples)
    return noise + sum(np.sin(2.0 * math.pi * f * time + 0.3) for f in lines), segment


def test_the_frequency_of_a_line_is_found_between_the_ordinates(rng: np.random.Generator) -> None:
    """To a fiftieth of an ordinate, however many samples there are."""
    samples, line = 2400, 23.04
    signal, segment = with_lines(samples, rng, line)
    for n in range(samples - 5, samples + 1):
        (found,) = steady_lines([signal[:n]], line_search(segment))
        assert abs(found.frequency - line) * n * segment.decay.step < 0.02


@pytest.mark.parametrize("samples", [60, 120, 250, 480])
def test_a_line_shows_in_few_samples_and_noise_shows_none(samples: int, rng: np.random.Generator) -> None:
    """Noise passes for a line in three records of a thousand at most, as in long ones."""
    signal, segment = with_lines(samples, rng)
    line = 2.4 * np.sin(2.0 * math.pi * 40.0 * segment.decay.step * np.arange(samples) + 0.3)
    (found,) = steady_lines([signal + line], line_search(segment))
    assert found.frequency == pytest.approx(40.0, abs=0.5 / (samples * segment.decay.step))
    noise = rng.standard_normal((500, samples))
    shown = sum(
        bool(steady_lines([one], line_search(segment)) + decaying_lines(one, line_search(segment)))
        for one in noise
    )
    # false-alarm rate 1e-4: each of the two searches has a rate of its own
    assert shown <= stats.binom.ppf(1.0 - 1e-4, len(noise), 2.0 * 3e-3)


@pytest.mark.parametrize("samples", range(2300, 2500, 40))
def test_what_lies_in_the_band_of_the_motion_is_no_line(samples: int, rng: np.random.Generator) -> None:
    """Wherever the ordinates are, the next one outside of the band among them."""
    signal, segment = with_lines(samples, rng)
    angle = segment.decay.frequency * segment.decay.step * np.arange(samples)
    for harmonic in (1, 3, 15):
        strong = 30.0 * np.sin((harmonic + 0.045) * angle)
        assert steady_lines([signal + strong], line_search(segment)) == ()


def log_density(fit: ForceFit, error: SensorError) -> float:
    """Log posterior density of an error of the sensor and the best force for it, up to a constant."""
    regression = replace(fit.regression, clock=error.of(fit.clock, fit.w0))
    best = integrate_force(Problem.of(regression), fit.prior, only_mode=True)
    return best.log_evidence - 0.125 * math.log(error.ratio) ** 2


@pytest.mark.parametrize(("seed", "size"), [(2, ERROR), (4, 3e-5)])
def test_no_other_error_of_the_sensor_is_more_probable(seed: int, size: float) -> None:
    """Climbs from two places had ended three to four nats below, with a force that was too quick."""
    record = correlated_record(np.random.default_rng(seed), size)
    names = ("random_force", "viscous_damping", "quadratic_drag", "cubic_stiffness", "sensor_offset")
    fit, factors = fitted(record, names), np.geomspace(0.4, 2.5, 7)
    pairs = product(factors * fit.record.error.ratio, factors * fit.record.error.correlation_time)
    others = [log_density(fit, SensorError(ratio, time)) for ratio, time in pairs if time < 0.06]
    assert max(others) < log_density(fit, fit.record.error) + 0.5


def test_rounding_makes_no_spikes_of_the_steps_of_a_digitiser(rng: np.random.Generator) -> None:
    """Most samples of a slow signal equal their neighbours; the others are a step off, and belong to it."""
    record = slow_decay(sampling_rate=2000.0, noise_sd=1e-7, duration=6.0, seed=1)
    step = 4e-4
    record = record.copy(data=step * np.round(record.values / step))
    blocks = {cut_records([r], SYSTEM)[0].block for r in (record, with_other_last_digits(record, rng))}
    assert len(blocks) == 1
    assert blocks.pop() > 1


def test_rounding_hides_no_end_of_a_range(rng: np.random.Generator) -> None:
    record = slow_decay(seed=1)
    record = record.copy(data=np.clip(record.values, -0.011, 0.013))
    (cut,) = cut_records([record], SYSTEM)
    (other,) = cut_records([with_other_last_digits(record, rng)], SYSTEM)
    assert np.count_nonzero(cut.sides == 1.0) > 50
    assert np.count_nonzero(cut.sides == -1.0) > 50
    np.testing.assert_array_equal(other.sides, cut.sides)


@pytest.mark.parametrize("seed", [3, 4])
def test_turning_points_of_ten_samples_a_period_are_no_spikes(seed: int) -> None:
    """The median of seven samples is a third of the amplitude off there, and equals most others."""
    system = fb.Oscillator(mass=1.0, stiffness=7.386)
    record = fb.simulate(
        system,
        friction=0.5,
        initial_displacement=70.0,
        duration=60.0,
        sampling_rate=5.0,
        noise_sd=0.5,
        seed=seed,
    )
    (segment,) = cut_records([record], system)
    assert segment.notes == ()
