"""A bent scale of the sensor, with a force that fluctuates and without."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import short_decay
from friction_bayes.loop.infer.record_fit import ForceFit
from unsteady_decays import FRICTION, RELEASE, SYSTEM, bent_record, fitted, probability_of

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "sensor_nonlinearity")


def size_of(fit: ForceFit, parameter: str) -> float:
    """Size of a parameter in the best set, of whatever width its prior is there."""
    pairs = zip(fit.law.columns, fit.coefficients, strict=True)
    return float(sum(size for column, size in pairs if column.parameter == parameter))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_it_is_found_beside_a_force_and_friction_with_it(rng: np.random.Generator, order: int) -> None:
    fit = fitted(bent_record(rng, 0.01, order), OFFERED)
    assert probability_of(fit, "sensor_nonlinearity") > 0.99
    assert size_of(fit, "curvature") * RELEASE * 10.0**order == pytest.approx(0.01, rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(FRICTION, rel=0.06)


@pytest.mark.parametrize("order", [0, 1])
def test_a_scale_bent_on_both_sides_is_separated_from_a_spring(rng: np.random.Generator, order: int) -> None:
    fit = fitted(bent_record(rng, 0.0, order, cubic=-0.02), OFFERED)
    assert probability_of(fit, "sensor_nonlinearity") > 0.99
    assert size_of(fit, "cubic") * (RELEASE * 10.0**order) ** 2 == pytest.approx(-0.02, rel=0.1)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(FRICTION, rel=0.06)


def test_it_is_found_where_no_force_may_fluctuate() -> None:
    bent = {"sensor_nonlinearity.curvature": 1.0, "sensor_offset.offset": 0.004}
    record = short_decay(SYSTEM, friction=0.02, duration=12.0, seed=5, effects=bent)
    report = fb.close_loop([record], SYSTEM, seed=1, random_force="none")
    assert report.candidates[0]["effects"] == ["sensor_nonlinearity", "sensor_offset"]
    (effect,) = [e for e in report.effects if e["name"] == "sensor_nonlinearity"]
    curvature = effect["parameters"]["curvature"]
    assert curvature["unit"] == "1/m"
    assert abs(curvature["mean"] - 1.0) < 4.0 * curvature["sd"] < 0.4
    low, high = report.friction_after["interval90"]
    assert low < 0.02 < high


def test_an_eccentric_encoder_is_bent_already() -> None:
    wheel = fb.Oscillator(inertia=1.0, stiffness=100.0)
    t = np.arange(0.0, 10.0, 0.01)
    fit = fitted(
        fb.make_record(t, (2.0 - 0.1 * t) * np.cos(10.0 * t), "angle"),
        ("sensor_nonlinearity", "encoder_eccentricity"),
        wheel,
    )
    both = {"sensor_nonlinearity", "encoder_eccentricity"}
    assert any(both & names for names in fit.sets)
    assert not any(both <= names for names in fit.sets)
