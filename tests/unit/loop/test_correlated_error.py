"""Errors of the sensor that neighbouring samples share: separated from a random force, and none invented."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.loop.noise.correlated_noise import NO_ERROR
from unsteady_decays import ERROR, ERROR_TIME, FRICTION, SYSTEM, WHITE, correlated_record, fitted

EFFECTS = ("random_force", "viscous_damping", "sensor_offset")


def test_it_is_found_beside_a_force_that_keeps_its_size(rng: np.random.Generator) -> None:
    fit = fitted(correlated_record(rng, ERROR), EFFECTS)
    assert fit.record.error.correlation_time == pytest.approx(ERROR_TIME, rel=0.4)
    assert fit.noise_sd == pytest.approx(math.hypot(WHITE, ERROR), rel=0.15)
    assert fit.posterior.probability > 0.99
    best = fit.posterior.best
    assert best.ratio * best.noise / (0.2 * FRICTION) == pytest.approx(1.0, rel=0.5)


def test_none_is_invented(rng: np.random.Generator) -> None:
    # a sensor whose noise is white, under a force as quick as such an error and under none
    for force in (0.0, 0.2):
        assert fitted(correlated_record(rng, 0.0, force), EFFECTS).record.error == NO_ERROR


def test_the_report_calls_the_noise_autoregressive(rng: np.random.Generator) -> None:
    report = fb.close_loop([correlated_record(rng, ERROR)], SYSTEM, seed=1, effects=EFFECTS)
    noise = report.noise
    assert (noise["model"], noise["order"]) == ("ar", 1)
    assert noise["correlation_length_s"] == pytest.approx(ERROR_TIME, rel=0.4)
    assert noise["sd"] == pytest.approx(math.hypot(WHITE, ERROR), rel=0.15)
    assert "left_over" not in report.because


def test_the_residual_contains_the_errors_too(rng: np.random.Generator) -> None:
    report = fb.close_loop([correlated_record(rng, ERROR)], SYSTEM, seed=1, effects=EFFECTS)
    for sd in (report.residual["after"]["rms"], report.held_out_error["noise_floor"]):
        assert sd == pytest.approx(report.noise["sd"], rel=0.1)
