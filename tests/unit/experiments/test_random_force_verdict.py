"""The paper's example with a force that fluctuates, and the jump that a record shows where it turns."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from experiments.estimated_response import jump_at_turns
from experiments.random_force_verdict import example_with_force
from friction_bayes.mechanics.testbed import paper_example

SETTINGS = {"correlation_time": 0.1, "noise_sd": 0.0, "sampling_rate": 100.0}


def test_without_a_force_it_is_the_example() -> None:
    record = example_with_force(1, size=0.0, **SETTINGS)
    expected = paper_example(1, noise_sd=0.0, sampling_rate=100.0)
    np.testing.assert_allclose(record.values, expected.values, atol=1e-12)


def test_force_grows_with_its_size_from_one_draw() -> None:
    still, small, large = (example_with_force(1, size=size, **SETTINGS).values for size in (0.0, 1e-3, 2e-3))
    moved = (small - still)[:900]
    # to first order the motion follows the force, from the same draw
    assert np.abs(moved).max() > 1e-7
    np.testing.assert_allclose((large - still)[:900], 2.0 * moved, atol=0.02 * np.abs(moved).max())


@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_jump_is_twice_the_friction_over_the_mass(friction: float, rng: np.random.Generator) -> None:
    system = fb.Oscillator(mass=5.0, stiffness=5.0 * (2.0 * math.pi * 2.9) ** 2)
    record = fb.simulate(
        system,
        friction=friction,
        initial_displacement=0.015,
        duration=5.0,
        sampling_rate=1000.0,
        quantity="acceleration",
    )
    turns = 500.0 / 2.9 * np.arange(1, 28)
    found, _ = jump_at_turns(record.values, turns, 10)
    # a turning point lies anywhere between two samples
    assert found == pytest.approx(2.0 * friction / 5.0, rel=0.05)
    noisy = record.values + rng.normal(0.0, 0.06, record.size)
    found, error = jump_at_turns(noisy, turns, 10)
    assert error == pytest.approx(0.06 * math.sqrt(2.0 / 10.0 / turns.size), rel=0.6)
    assert abs(found - 2.0 * friction / 5.0) < 5.0 * error
