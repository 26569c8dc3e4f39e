"""How probable a worse forecast is, against errors that are drawn as the forecast promises them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes.loop.checks.search_forecast import Forecast, chance_of_worse

TIME = np.arange(200) * 0.01
WAVE = np.sin(10.0 * TIME)


def forecast(signal: np.ndarray, mean: np.ndarray, sd: float = 1.0) -> Forecast:
    return Forecast(
        time=TIME, signal=signal, mean=mean, sd=np.full(TIME.size, sd), free=np.ones(TIME.size, bool)
    )


def test_it_is_the_share_of_forecasts_that_go_as_far_astray() -> None:
    """Errors in step with the difference: the bound that is taken is then reached; error 0.007 in all."""
    other, final = 3.0 * np.sign(WAVE), np.zeros(TIME.size)
    difference = final - other
    worse = 0.7 * np.sign(WAVE)

    def excess(error: np.ndarray) -> np.ndarray:
        return np.sum(error**2 - (error + difference) ** 2, axis=-1)

    drawn = np.random.default_rng(11).standard_normal((20_000, 1)) * np.sign(WAVE)
    share = float(np.mean(excess(drawn) >= excess(worse)))
    chance = chance_of_worse([forecast(worse, other)], [forecast(worse, final)])
    assert chance == pytest.approx(share, abs=0.014)


def test_a_forecast_that_says_little_may_well_be_worse() -> None:
    signal = WAVE
    far = forecast(signal, 0.5 * WAVE, sd=1.0)
    sure = forecast(signal, 0.5 * WAVE, sd=0.05)
    assert chance_of_worse([forecast(signal, WAVE)], [far]) > 0.3
    assert chance_of_worse([forecast(signal, WAVE)], [sure]) < 1e-6


def test_the_same_forecast_is_no_worse_and_none_is_unknown() -> None:
    one = forecast(WAVE, 0.9 * WAVE)
    assert chance_of_worse([one], [one]) == 1.0
    assert math.isnan(chance_of_worse([one], []))
