"""A stiffness that changes over the record, found along the measured motion."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, slow_decay
from friction_bayes.loop.checks.forecast import forecast
from friction_bayes.mechanics.integrate import integrate
from unsteady_decays import fitted

FRICTION, CHANGE = 0.07, 0.005


@pytest.fixture
def record(seed: int) -> xr.DataArray:
    drift = {"stiffness_drift.relative_change": CHANGE}
    return slow_decay(friction=FRICTION, noise_sd=5e-5, seed=seed, effects=drift)


def test_it_is_found_with_its_size_and_friction(record: xr.DataArray) -> None:
    report = fb.close_loop([record], SYSTEM, seed=1)
    effect = next(e for e in report.effects if e["name"] == "stiffness_drift")
    assert effect["probability"] > 0.9
    found = effect["parameters"]["relative_change"]
    assert abs(found["mean"] - CHANGE) < 5.0 * found["sd"]
    assert abs(report.friction_after["mean"] - FRICTION) < 5.0 * report.friction_after["sd"]


def test_it_goes_on_in_the_forecast(record: xr.DataArray, seed: int) -> None:
    """Its clock is that of the record: one that began anew would be several noise sd off at the end."""
    effects = ("stiffness_drift",)
    predicted = forecast(fitted(record, effects, SYSTEM), effects, np.random.default_rng(seed))
    assert predicted is not None
    z = (predicted.signal - predicted.mean) / predicted.sd
    assert np.sqrt(np.mean(z**2)) < 2.0


def test_what_resists_the_motion_is_friction_and_not_the_spring(record: xr.DataArray) -> None:
    """Searched for where it is named; it then takes a measured friction force for friction alone."""
    time = np.asarray(record["time"])
    motion = integrate(SYSTEM, FRICTION, 0.0147, 0.0, time, {"stiffness_drift.relative_change": CHANGE})
    report = fb.close_loop(
        [record],
        SYSTEM,
        seed=1,
        effects=["stiffness_drift"],
        reference_force=FRICTION * np.sign(motion.velocity),
    )
    assert report.candidates[0]["effects"] == ["stiffness_drift"]
    forces = report.traces[0].forces
    assert forces is not None
    moving = np.abs(motion.velocity[: forces[2].size]) > 0.02
    np.testing.assert_allclose(np.abs(forces[2][moving]), FRICTION, rtol=0.1)
