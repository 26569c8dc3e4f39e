"""Friction that depends on the position, together with a force that fluctuates."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.loop.columns.moving_record import why_not_evaluated
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import cut_records
from unsteady_decays import FRICTION, RELEASE, SYSTEM, WHEEL, fitted, probability_of, rubbed_record

OFFERED = ("viscous_damping", "quadratic_drag", "cubic_stiffness", "sensor_offset", "position_friction")


def test_it_is_found_and_friction_is_that_at_the_rest(rng: np.random.Generator) -> None:
    fit = fitted(rubbed_record(rng, 0.3, -0.8), OFFERED)
    assert probability_of(fit, "position_friction") > 0.99
    found = dict(zip([c.parameter for c in fit.law.columns], fit.coefficients, strict=True))
    friction = fit.coefficients[fit.law.dry_friction]
    assert friction == pytest.approx(FRICTION, rel=0.1)
    # the coefficient is that over the friction which the column assumes
    assumed = fit.law.friction / fit.law.unit_force / friction
    assert found["slope"] * assumed * RELEASE == pytest.approx(0.3, abs=0.15)
    assert found["curvature"] * assumed * RELEASE**2 == pytest.approx(-0.8, abs=0.3)


@pytest.mark.parametrize(("release", "offered"), [(0.5, True), (2.5, False)])
def test_what_turns_half_a_turn_repeats_it_and_has_none(release: float, offered: bool) -> None:
    t = np.arange(0.0, 10.0, 0.01)
    record = fb.make_record(t, release * (1.0 - 0.05 * t) * np.cos(10.0 * t), "angle")
    fit = fitted(record, ("viscous_damping", "position_friction"), WHEEL)
    assert any("position_friction" in names for names in fit.sets) == offered


@pytest.mark.parametrize(
    ("system", "quantity", "said"),
    [
        (WHEEL, "angular_velocity", "how far it swings is unknown without a calibration of the sensor"),
        (SYSTEM, "velocity", ""),
    ],
)
def test_of_what_turns_it_asks_for_a_calibrated_sensor(
    system: fb.Oscillator, quantity: str, said: str
) -> None:
    t = np.arange(0.0, 10.0, 0.01)
    record = fb.make_record(t, 0.2 * (1.0 - 0.05 * t) * np.cos(10.0 * t), quantity, unit="V")
    (segment,) = cut_records([record], system)
    assert why_not_evaluated("position_friction", segment, scales_of((segment,), system)) == said
