"""Friction that approaches a level as the record goes on."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from friction_bayes.mechanics.effects import EFFECTS
from unsteady_decays import RELEASE, SYSTEM, fitted, probability_of

OFFERED = ("friction_drift", "curved_friction_drift", "cubic_stiffness")
EFFECT = EFFECTS["curved_friction_drift"]
FRICTION = 0.018


def settling(change: float, time_share: float, seed: int = 4) -> xr.DataArray:
    """Record of a decay whose friction changes as the catalogue has it."""
    return fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=RELEASE,
        duration=15.0,
        sampling_rate=100.0,
        noise_sd=1e-5,
        seed=seed,
        effects={
            "curved_friction_drift.relative_change": change,
            "curved_friction_drift.time_share": time_share,
        },
    )


def test_it_is_found_and_friction_is_its_mean() -> None:
    fit = fitted(settling(-0.8, 0.3), OFFERED)
    assert probability_of(fit, "curved_friction_drift") > 0.99
    friction = fit.coefficients[fit.law.dry_friction] * fit.law.unit_force
    assert friction == pytest.approx(FRICTION, rel=0.02)


def test_a_straight_drift_is_not_called_curved() -> None:
    fits = [fitted(settling(-0.8, 100.0, seed), OFFERED) for seed in range(4, 8)]
    assert np.mean([probability_of(fit, "friction_drift") for fit in fits]) > 0.9


@pytest.mark.parametrize("time_share", [0.05, 0.4, 3.0, 999.0, 1001.0, 1e12])
def test_friction_changes_by_its_change_about_its_mean(time_share: float) -> None:
    time, values = np.linspace(0.0, 1.0, 2001), np.array([0.5, time_share])
    change = [EFFECT.force(t, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, values, 0) for t in time]
    assert np.trapezoid(change, time) == pytest.approx(0.0, abs=1e-4)
    assert change[-1] - change[0] == pytest.approx(0.5, rel=1e-9)


def test_friction_is_the_mean_over_the_motion_not_over_the_rest_after_it(seed: int) -> None:
    """The simulation's drift is zero in the middle of the record, and the mass rests for a third of that."""
    whole, friction, change = 14.0, 0.05, 0.4
    clean = fb.simulate(
        SYSTEM,
        friction=friction,
        initial_displacement=RELEASE,
        duration=whole,
        sampling_rate=100.0,
        noise_sd=0.0,
        seed=seed,
        effects={"friction_drift.relative_change": change},
    )
    moves = float(clean["time"].values[np.flatnonzero(np.diff(clean.values))[-1] + 1])
    assert moves < 0.75 * whole
    noise = 2e-6 * np.random.default_rng(seed).standard_normal(clean.size)
    found = fb.close_loop([clean + noise], SYSTEM, effects=["friction_drift"]).friction_after
    expected = friction * (1.0 + change * (0.5 * moves / whole - 0.5))
    assert found["mean"] == pytest.approx(expected, abs=4.0 * found["sd"] + 1e-3 * expected)
