"""The likelihood of residuals: white, with outliers, censored; and the colour of noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

import friction_bayes as fb
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.noise.correlated_noise import colour_of, is_coloured
from friction_bayes.loop.noise.likelihood import fit_noise, log_densities
from friction_bayes.mechanics.effects import Scales

SCALES = Scales(
    system=fb.Oscillator(mass=1.0, stiffness=1.0),
    quantity=QUANTITIES["displacement"],
    amplitude=1.0,
    duration=10.0,
    sampling_rate=100.0,
)
N = 3000
PERIOD = 50


def coloured(rng: np.random.Generator, *coefficients: float) -> np.ndarray:
    noise = lfilter([1.0], [1.0, *(-c for c in coefficients)], rng.standard_normal(N + 200))
    return np.asarray(noise[200:])


def test_white_densities_are_those_of_the_sd_found(rng: np.random.Generator) -> None:
    x = 0.3 * rng.standard_normal(N)
    fit = fit_noise(x, np.zeros(N), SCALES, outliers=False)
    each = log_densities(x, np.zeros(N), fit)
    np.testing.assert_allclose(each, stats.norm.logpdf(x, scale=np.sqrt(np.mean(x**2))), rtol=1e-9)


def test_outliers_are_found_and_named(rng: np.random.Generator) -> None:
    far = rng.random(N) < 0.05
    x = np.where(far, 10.0, 1.0) * rng.standard_normal(N)
    fit, plain = (fit_noise(x, np.zeros(N), SCALES, outliers=outliers) for outliers in (True, False))
    assert log_densities(x, np.zeros(N), fit).sum() > log_densities(x, np.zeros(N), plain).sum() + 250.0
    # standard errors: 0.4 % of the fraction, 6 % and 1.4 % of the scales
    assert fit.fraction == pytest.approx(0.05, abs=0.02)
    assert fit.scale == pytest.approx(10.0, rel=0.3)
    assert fit.sd == pytest.approx(1.0, rel=0.07)
    assert fit.core[np.abs(x) > 10.0].max() < 0.05 < 0.9 < np.median(fit.core)


def test_a_held_sample_has_the_probability_beyond_its_level() -> None:
    values, sides = np.array([0.1, -0.1, 0.3, -0.2]), np.array([0.0, 0.0, 1.0, -1.0])
    fit = fit_noise(values, sides, SCALES, outliers=False)
    assert fit.sd == pytest.approx(0.1)
    each = log_densities(values, sides, fit)
    np.testing.assert_allclose(each[2:], stats.norm.logcdf([-3.0, -2.0]), rtol=1e-9)


def test_white_noise_is_called_white_at_its_false_alarm_rate(rng: np.random.Generator) -> None:
    """Level 1e-4: more than one alarm in 200 has a probability of 2e-4."""
    alarms = sum(is_coloured(rng.standard_normal(N), 1.0, 2.0 * math.pi / PERIOD) for _ in range(200))
    assert alarms <= 1


def test_what_is_locked_to_the_motion_is_no_colour(rng: np.random.Generator) -> None:
    angle = 2.0 * math.pi * np.arange(N) / PERIOD
    misfit = sum(np.cos(k * angle) for k in range(1, 6))
    assert not is_coloured(rng.standard_normal(N) + misfit, 1.0, 2.0 * math.pi / PERIOD)


@pytest.mark.parametrize("coefficients", [(0.7,), (1.2, -0.5)])
def test_colour_is_found_with_its_order_and_length(
    coefficients: tuple[float, ...], rng: np.random.Generator
) -> None:
    x = coloured(rng, *coefficients)
    assert is_coloured(x, 1.0, 2.0 * math.pi / PERIOD)
    colour = colour_of(x, 0)
    assert colour is not None
    assert colour.autoregression is not None
    order, said = colour.autoregression.order, colour.described(0.01)
    assert len(coefficients) <= order <= len(coefficients) + 3
    assert said["order"] == order
    # as far as the true correlation falls below 1/e
    impulse = lfilter([1.0], [1.0, *(-c for c in coefficients)], np.eye(1, 400)[0])
    correlation = np.correlate(impulse, impulse, mode="full")[399:]
    length = 0.01 * np.flatnonzero(correlation < correlation[0] / math.e)[0]
    assert said["correlation_length_s"] == pytest.approx(length, abs=0.011)


def test_white_noise_has_no_colour(rng: np.random.Generator) -> None:
    assert colour_of(rng.standard_normal(N), 0) is None
