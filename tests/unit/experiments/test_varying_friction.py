"""Friction that changes from sample to sample: the exact decay where it is constant, else its energy."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.varying_friction import varying_friction_decay
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.mechanics.coulomb import coulomb_decay

SYSTEM = Oscillator(mass=5.0, stiffness=1660.0)
TIME = np.arange(9000) / 1000.0


@pytest.mark.parametrize(("x0", "v0"), [(0.015, 0.0), (-0.004, 0.2), (0.01, -0.1)])
def test_constant_level_is_the_exact_coulomb_decay(x0: float, v0: float) -> None:
    exact = coulomb_decay(SYSTEM, 0.3, x0, v0, TIME)
    motion, force = varying_friction_decay(SYSTEM, np.full(TIME.size, 0.3), x0, v0, TIME)
    np.testing.assert_allclose(motion.displacement, exact.displacement, atol=1e-12)
    np.testing.assert_allclose(motion.velocity, exact.velocity, atol=1e-10)
    assert motion.stop_time == pytest.approx(exact.stop_time, rel=1e-9)
    moving = exact.moving & (np.abs(exact.velocity) > 1e-9)
    np.testing.assert_allclose(force[moving], 0.3 * np.sign(exact.velocity[moving]))
    np.testing.assert_allclose(motion.acceleration[moving], exact.acceleration[moving], atol=1e-8)


def test_energy_lost_is_what_the_force_took(rng: np.random.Generator) -> None:
    level = 0.2 * (1.0 + 0.5 * rng.random(TIME.size))
    motion, force = varying_friction_decay(SYSTEM, level, 0.012, 0.0, TIME)
    energy = 0.5 * SYSTEM.moving * motion.velocity**2 + 0.5 * SYSTEM.stiffness * motion.displacement**2
    # where no reversal falls between two samples the force is constant over the path between them
    same = np.sign(force[:-1]) == np.sign(motion.velocity[1:])
    taken = force[:-1] * np.diff(motion.displacement)
    np.testing.assert_allclose(np.diff(energy)[same], -taken[same], atol=1e-12)
    assert np.count_nonzero(same & motion.moving[1:]) > 0.9 * np.count_nonzero(motion.moving)


def test_rest_is_final() -> None:
    level = np.where(TIME < 2.0, 5.0, 1.0)
    motion, force = varying_friction_decay(SYSTEM, level, 0.002, 0.0, TIME)
    assert motion.stop_time == 0.0
    assert not motion.velocity.any()
    np.testing.assert_allclose(force, -SYSTEM.stiffness * 0.002)


def test_refuses_what_is_no_level() -> None:
    for level, words in ((np.full(3, 0.1), "shape"), (np.full(TIME.size, -0.1), "negative")):
        with pytest.raises(InputError, match=words):
            varying_friction_decay(SYSTEM, level, 0.01, 0.0, TIME)
    with pytest.raises(InputError, match="pendulum"):
        varying_friction_decay(Pendulum(inertia=1.0, stiffness=1.0), np.full(3, 0.1), 0.1, 0.0, TIME[:3])
