"""A force that repeats with every turn, next to one that fluctuates."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.errors import InputError
from friction_bayes.core.text import words
from unsteady_decays import SYSTEM, WHEEL, fitted, probability_of, sensed, unbalanced_record, unsteady_motion

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "position_force", "encoder_eccentricity")


def test_it_is_found_and_friction_with_it(rng: np.random.Generator) -> None:
    fit = fitted(unbalanced_record(rng, 0.3), OFFERED, WHEEL)
    assert probability_of(fit, "position_force") > 0.99
    columns = zip(fit.law.columns, fit.coefficients, strict=True)
    found = {c.parameter: a for c, a in columns if c.effect == "position_force"}
    # 100 N m/rad; a pull is on the other side than a restoring force, and sines go with the stiffness
    expected = {"once": -0.75 * np.sin(0.7), "twice": 0.0, "thrice": -0.375 * np.sin(-1.0), "four_times": 0.0}
    for often, size in expected.items():
        assert found[f"{often}_cosine"] == pytest.approx(size, abs=0.15)
    assert fit.coefficients[fit.law.dry_friction] == pytest.approx(0.025, rel=0.03)


def test_it_takes_no_energy_out_of_the_motion(rng: np.random.Generator) -> None:
    fit = fitted(unbalanced_record(rng, 0.3), OFFERED, WHEEL)
    effects = {fit.law.columns[j].effect for j in fit.law.resisting}
    assert "position_force" not in effects


def test_a_small_swing_cannot_tell_it_from_a_spring(rng: np.random.Generator) -> None:
    fit = fitted(unbalanced_record(rng, 0.3, release=1.2), OFFERED, WHEEL)
    assert not any("position_force" in names for names in fit.sets)


def test_what_moves_along_a_line_has_none(rng: np.random.Generator) -> None:
    fit = fitted(sensed(unsteady_motion(rng)[0]), OFFERED, SYSTEM)
    assert not any("position_force" in names for names in fit.sets)
    with pytest.raises(InputError, match="position_force"):
        fb.simulate(
            fb.Oscillator(mass=1.0, stiffness=100.0),
            friction=0.02,
            initial_displacement=0.02,
            duration=2.0,
            sampling_rate=100.0,
            effects={"position_force.once_sine": 0.001},
        )


def test_a_simulated_wheel_out_of_balance_is_pulled_aside() -> None:
    record = fb.simulate(
        WHEEL,
        friction=0.0,
        initial_displacement=0.05,
        duration=6.3,
        sampling_rate=1000.0,
        quantity="angle",
        effects={"position_force.once_cosine": 2.0},
    )
    # about where the spring holds the wheel against 2 N m
    assert float(record.mean()) == pytest.approx(-0.02, abs=5e-4)


@pytest.mark.parametrize(
    ("system", "quantity", "asked", "reason"),
    [
        (SYSTEM, "displacement", ["position_force", "random_force"], "this moves along a line"),
        (SYSTEM, "displacement", ["encoder_eccentricity", "random_force"], "no sensor of displacement"),
        (
            WHEEL,
            "angle",
            ["position_force", "random_force"],
            "does not distinguish it from other effects, 1.6 rad would",
        ),
        (SYSTEM, "acceleration", ["sensor_hysteresis"], "no sensor of acceleration"),
    ],
)
def test_what_was_asked_for_and_is_not_evaluated_is_reported(
    system: fb.Oscillator, quantity: str, asked: list[str], reason: str
) -> None:
    record = fb.simulate(
        system,
        friction=0.005 * system.stiffness,
        initial_displacement=0.5,
        duration=8.0,
        sampling_rate=50.0,
        quantity=quantity,
        noise_sd=2e-3,
        seed=1,
    )
    report = fb.close_loop([record], system, seed=1, effects=asked)
    assert not any(asked[0] in candidate["effects"] for candidate in report.candidates)
    (note,) = report.notes
    assert note.startswith(words(asked[0]))
    assert reason in note
