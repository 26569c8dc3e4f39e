"""The rest of a record forecast from its first part."""

from __future__ import annotations

import numpy as np
import pytest

from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.loop.checks.forecast import forecast, forecast_errors
from unsteady_decays import fitted


@pytest.mark.parametrize(
    "effects",
    [
        {"stiffness_drift.relative_change": 0.005},
        {"friction_drift.relative_change": -0.3, "asymmetric_friction.asymmetry": 0.1},
    ],
)
def test_what_drifts_goes_on_while_all_else_stays(effects: dict[str, float], seed: int) -> None:
    """Of a noise at which a friction, or a friction over the stiffness, of 1 % more would be seen."""
    record = slow_decay(friction=0.07, noise_sd=5e-7, seed=seed, effects=effects)
    names = tuple(name.split(".")[0] for name in effects)
    predicted = forecast(fitted(record, names, SYSTEM), names, np.random.default_rng(seed))
    assert predicted is not None
    z = (predicted.signal - predicted.mean) / predicted.sd
    assert np.sqrt(np.mean(z**2)) < 2.0


def test_monte_carlo_error_of_the_error(seed: int) -> None:
    """Of 60 forecasts by as many seeds: their sd has an error of 9 %, of which four are allowed."""
    record = slow_decay(friction=0.07, noise_sd=1e-6, seed=seed, effects=fluctuating_friction())
    fit = fitted(record, ("random_force",), SYSTEM)
    draws = [forecast(fit, (), np.random.default_rng([seed, i])) for i in range(60)]
    errors = [forecast_errors([each]) for each in draws if each is not None]
    assert len(errors) == 60
    spread = np.std([error["after"] for error in errors], ddof=1)
    stated = np.sqrt(np.mean([error["after_mcse"] ** 2 for error in errors]))
    assert stated == pytest.approx(spread, rel=4.0 * 0.09)


def test_records_of_one_error_share_its_monte_carlo_error(seed: int) -> None:
    """The same forecast twice, as if by independent draws, has an error smaller by the root of two."""
    fit = fitted(slow_decay(friction=0.07, noise_sd=1e-6, seed=seed), (), SYSTEM)
    one = forecast(fit, (), np.random.default_rng(seed))
    assert one is not None
    once, twice = forecast_errors([one]), forecast_errors([one, one])
    assert twice["after"] == pytest.approx(once["after"])
    assert twice["after_mcse"] == pytest.approx(once["after_mcse"] / np.sqrt(2.0))
