"""Rotations whose frequency rises as a pendulum's does while the swing dies out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.decay.pendulum_likeness import pendulum_notes, slower_swings
from friction_bayes.loop.data.prepared_record import cut_records

GIVEN = {"inertia": 0.5, "stiffness": 12.5}
SPRING, PENDULUM = fb.Oscillator(**GIVEN), fb.Pendulum(**GIVEN)
UNITS = {"angle": 1.0, "angular_velocity": 5.0, "angular_acceleration": 25.0}


def swing(
    system: fb.Oscillator, release: float, seed: int, *, quantity: str = "angle", **settings: Any
) -> Any:
    usual = {"friction": 0.06 * release, "noise_sd": 0.01 * release * UNITS[quantity], "duration": 25.0}
    return fb.simulate(
        system,
        initial_displacement=release,
        sampling_rate=50.0,
        quantity=quantity,
        seed=seed,
        **usual | settings,
    )


@pytest.mark.parametrize("quantity", UNITS)
@pytest.mark.parametrize("release", [0.5, 0.8, 1.2])
def test_a_pendulum_is_recognised_and_a_spring_is_none(quantity: str, release: float, seed: int) -> None:
    found = slower_swings(find_free_decay(swing(PENDULUM, release, seed, quantity=quantity), SPRING))
    assert found is not None
    assert found.pendulum
    # theta^2/16 at either end
    assert found.rise == pytest.approx((found.largest**2 - found.smallest**2) / 16.0, rel=0.3)
    spring = slower_swings(find_free_decay(swing(SPRING, release, seed, quantity=quantity), SPRING))
    # no pendulum's angular acceleration exceeds that at a right angle
    assert spring is None or not spring.pendulum
    assert (spring is None) == (quantity == "angular_acceleration" and release > 1.0)


def test_what_is_declared_a_pendulum_linear_or_in_volts_is_not_judged(seed: int) -> None:
    record = swing(PENDULUM, 0.8, seed)
    assert pendulum_notes(find_free_decay(record, PENDULUM)) == ()
    time = record["time"].values
    volts = fb.make_record(time, record.values, "angle", unit="V")
    assert slower_swings(find_free_decay(volts, SPRING)) is None
    linear = fb.make_record(time, record.values, "displacement")
    assert slower_swings(find_free_decay(linear, fb.Oscillator(mass=0.5, stiffness=12.5))) is None


def test_no_spring_is_taken_for_a_pendulum(seed: int) -> None:
    """Chance exceeds five standard errors of six degrees of freedom in 1 of 800."""
    rng = np.random.default_rng(seed)
    false = 0
    for _ in range(60):
        release, friction = rng.uniform(0.2, 2.0), rng.uniform(0.04, 0.25)
        effects = {"random_force.sd": friction * release * rng.uniform(0.3, 3.0)}
        effects["random_force.correlation_time"] = 10.0 ** rng.uniform(-1.5, 0.5)
        record = swing(
            SPRING,
            release,
            int(rng.integers(2**31)),
            friction=friction * release,
            noise_sd=release * 10.0 ** rng.uniform(-3.0, -1.2),
            effects=effects if rng.random() < 0.5 else {},
        )
        found = slower_swings(find_free_decay(record, SPRING))
        false += found is not None and found.pendulum
    assert false <= 1


@pytest.mark.filterwarnings("ignore::friction_bayes.core.errors.RecordWarning")
def test_it_is_the_first_note_and_no_mass_is_doubted_for_it(seed: int) -> None:
    record = swing(PENDULUM, 1.4, seed)
    found = fb.estimate(record, SPRING, method="envelope")
    (note,) = [note for note in found.notes if "looks like a pendulum" in note]
    assert "(--pendulum, fb.Pendulum)" in note
    assert not any("check inertia" in note for note in found.notes)
    (segment,) = cut_records([record], SPRING)
    assert "looks like a pendulum" in segment.notes[0]
    assert not any("check inertia" in note for note in segment.notes)
    assert not any("looks like" in note for note in fb.estimate(record, PENDULUM, method="envelope").notes)
