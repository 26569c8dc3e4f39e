"""How probable a worse forecast is, against errors that are drawn as the forecast promises them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes.loop.checks.search_forecast import Forecast, chance_of_worse

TIME = np.arange(200) * 0.01
WAVE = np.cos(10.0 * TIME)


def forecast(signal: np.ndarray, mean: np.ndarray, sd: float = 1.0) -> Forecast:
    return Forecast(
        time=TIME, signal=signal, mean=mean, sd=np.full(TIME.size, sd), free=np.ones(TIME.size, bool)
    )


@pytest.mark.parametrize("error", [-0.9, -1.3, -2.0])
def test_it_is_the_share_of_forecasts_that_go_as_far_astray(error: float) -> None:
    """Errors in step with the difference; of 20,000 drawn the share is known to 0.014 (four sd)."""
    sign = np.sign(WAVE)
    other, final = -1.2 * sign, np.zeros(TIME.size)

    def ratio(size: np.ndarray) -> np.ndarray:
        return np.abs(size) / np.abs(size + 1.2)

    drawn = np.random.default_rng(11).standard_normal(20_000)
    share = float(np.mean(ratio(drawn) >= ratio(np.array(error))))
    chance = chance_of_worse([forecast(error * sign, other)], [forecast(error * sign, final)])
    assert 0.01 < share < 0.4
    assert chance == pytest.approx(share, abs=0.014)


def test_a_forecast_that_says_little_may_well_be_worse() -> None:
    near = forecast(WAVE, 0.8 * WAVE)
    far = forecast(WAVE, 0.5 * WAVE, sd=1.0)
    sure = forecast(WAVE, 0.5 * WAVE, sd=0.02)
    assert chance_of_worse([near], [far]) > 0.05
    assert chance_of_worse([near], [sure]) < 1e-3


def test_the_same_forecast_is_no_worse_and_none_is_unknown() -> None:
    one = forecast(WAVE, 0.9 * WAVE)
    assert chance_of_worse([one], [one]) == 1.0
    assert chance_of_worse([forecast(WAVE, 0.8 * WAVE)], [one]) == 1.0
    assert math.isnan(chance_of_worse([one], []))
