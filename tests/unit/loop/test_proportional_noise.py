"""Noise in proportion to the signal: found as what it is, separated from jitter and from outliers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit

import friction_bayes as fb
from friction_bayes.mechanics.effects import EFFECTS
from unsteady_decays import QUANTITIES, RELEASE, SYSTEM, fitted

NOISE = 4e-5
SHARE = 2.0 * NOISE / RELEASE
"""Twice the noise of the sensor at full swing."""


def decay(seed: int, quantity: str = "displacement", **effects: float):  # type: ignore[no-untyped-def]
    order = QUANTITIES.index(quantity)
    return fb.simulate(
        SYSTEM,
        friction=0.01,
        initial_displacement=RELEASE,
        duration=15.0,
        sampling_rate=100.0,
        quantity=quantity,
        noise_sd=NOISE * 10.0**order,
        seed=seed,
        effects=effects,
    )


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_it_is_found_with_its_size_and_leaves_the_sensors_noise(quantity: str, seed: int) -> None:
    record = decay(seed, quantity, **{"proportional_noise.share": SHARE})
    fit = fitted(record, ("viscous_damping", "timing_jitter", "proportional_noise", "sensor_offset"))
    assert fit.growth is not None
    assert fit.growth.effect.name == "proportional_noise"
    assert expit(fit.growth.log_odds) > 0.99
    assert fit.posterior.noise_sd * fit.unit == pytest.approx(NOISE * 10.0**fit.segment.order, rel=0.15)
    assert abs(np.log(fit.growth.ratio * fit.posterior.noise_sd / SHARE)) < 5.0 * fit.growth.log_sd
    assert fit.growth.ratio * fit.posterior.noise_sd == pytest.approx(SHARE, rel=0.3)


def test_the_report_names_it_and_no_outliers(seed: int) -> None:
    record = decay(seed, **{"proportional_noise.share": 2.0 * SHARE})
    report = fb.close_loop([record], SYSTEM, seed=1)
    named = {effect["name"]: effect for effect in report.effects}
    assert named["proportional_noise"]["probability"] > 0.99
    assert "outliers" not in named
    share = named["proportional_noise"]["parameters"]["share"]
    assert share["mean"] == pytest.approx(2.0 * SHARE, rel=0.3)
    assert share["unit"] == "1"
    assert report.noise["sd"] == pytest.approx(NOISE, rel=0.3)
    assert report.held_out_error["inside90"] > 0.8


def test_simulated_noise_is_in_proportion_to_the_signal() -> None:
    clean = decay(1).values
    noisy = decay(1, **{"proportional_noise.share": 0.01}).values - clean
    large = np.abs(clean) > 0.3 * RELEASE
    assert np.std(noisy[large] / clean[large]) == pytest.approx(0.01, rel=0.15)
    assert EFFECTS["proportional_noise"].kind == "noise"
