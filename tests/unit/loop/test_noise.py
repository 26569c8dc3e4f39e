"""The likelihood of residuals: white, with outliers, censored; and the colour of noise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

import friction_bayes as fb
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.noise.colour import colour_of, is_coloured
from friction_bayes.loop.noise.likelihood import NoiseModel, fit_noise, log_densities
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


def test_white_deviance_is_twice_the_negative_log_likelihood(rng: np.random.Generator) -> None:
    x = 0.3 * rng.standard_normal(N)
    fit = fit_noise(x, np.zeros(N), NoiseModel(), SCALES)
    assert fit.deviance == pytest.approx(-2.0 * stats.norm.logpdf(x, scale=x.std()).sum(), rel=1e-3)
    each = log_densities(x, np.zeros(N), NoiseModel(), fit)
    assert each.sum() == pytest.approx(-0.5 * fit.deviance, rel=1e-9)


def test_outliers_are_found_and_count_little(rng: np.random.Generator) -> None:
    far = rng.random(N) < 0.05
    x = np.where(far, 10.0, 1.0) * rng.standard_normal(N)
    fit = fit_noise(x, np.zeros(N), NoiseModel(outliers=True), SCALES)
    plain = fit_noise(x, np.zeros(N), NoiseModel(), SCALES)
    assert fit.deviance < plain.deviance - 500.0
    # standard errors: 0.4 % of the fraction, 6 % and 1.4 % of the scales
    assert fit.fraction == pytest.approx(0.05, abs=0.02)
    assert fit.scale == pytest.approx(10.0, rel=0.3)
    assert fit.sd == pytest.approx(1.0, rel=0.07)
    assert fit.weight[np.abs(x) > 10.0].max() < 0.05 * np.median(fit.weight)


@pytest.mark.parametrize("outliers", [False, True])
def test_weights_and_pseudo_residuals_are_those_of_the_censored_likelihood(
    outliers: bool, rng: np.random.Generator
) -> None:
    """Half the gradient of the deviance in the prediction is minus weight times pseudo-residual."""
    signal = np.sin(2.0 * math.pi * np.arange(N) / PERIOD)
    x = signal + 0.05 * rng.standard_normal(N)
    if outliers:
        x += np.where(rng.random(N) < 0.02, 0.5, 0.0) * rng.standard_normal(N)
    sides = np.where(x > 0.8, 1.0, np.where(x < -0.8, -1.0, 0.0))
    values = np.clip(x, -0.8, 0.8)
    noise_model = NoiseModel(outliers=outliers, censored=True)
    column = np.cos(np.arange(N) / 7.0)

    def deviance(shift: float) -> float:
        return fit_noise(values - signal - shift * column, sides, noise_model, SCALES).deviance

    fit = fit_noise(values - signal, sides, noise_model, SCALES)
    step = 1e-4
    slope = (deviance(step) - deviance(-step)) / (2.0 * step)
    expected = -2.0 * float(column @ (fit.weight * fit.residual))
    # the scale is that of the free samples, so it is not at the optimum of the whole
    assert slope == pytest.approx(expected, rel=0.05, abs=0.02 * float(np.sqrt(fit.weight @ column**2)))


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
