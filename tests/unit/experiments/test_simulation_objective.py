"""The likelihood of a simulated fit to second order: weights and pseudo-residuals of censored samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from experiments.simulation.objective import pseudo_residuals
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.loop.noise.likelihood import fit_noise, log_densities
from friction_bayes.mechanics.effects import Scales

SCALES = Scales(
    system=fb.Oscillator(mass=1.0, stiffness=1.0),
    quantity=QUANTITIES["displacement"],
    amplitude=1.0,
    duration=10.0,
    sampling_rate=100.0,
)
N, PERIOD = 3000, 50


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
    column = np.cos(np.arange(N) / 7.0)

    def deviance(shift: float) -> float:
        residual = values - signal - shift * column
        noise = fit_noise(residual, sides, SCALES, outliers=outliers)
        return -2.0 * float(log_densities(residual, sides, noise).sum())

    fit = fit_noise(values - signal, sides, SCALES, outliers=outliers)
    weight, pseudo = pseudo_residuals(values - signal, sides, fit)
    step = 1e-4
    slope = (deviance(step) - deviance(-step)) / (2.0 * step)
    expected = -2.0 * float(column @ (weight * pseudo))
    # the scale is that of the free samples, so it is not at the optimum of the whole
    assert slope == pytest.approx(expected, rel=0.05, abs=0.02 * float(np.sqrt(weight @ column**2)))
