"""Friction that changes from sample to sample: the exact decay where it is constant, else its energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

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


def test_damping_and_outer_force_against_runge_kutta() -> None:
    # half cycle by half cycle by SciPy's DOP853, the outer force a step in the middle of the record
    ratio, level, time = 0.01, 0.3, TIME[:3000]
    outside = np.where(time < 1.0005, 0.2, -0.25)
    motion, _ = varying_friction_decay(
        SYSTEM, np.full(time.size, level), 0.015, 0.0, time, external_force=outside, damping_ratio=ratio
    )
    c, k, m = 2.0 * ratio * np.sqrt(SYSTEM.stiffness * SYSTEM.mass), SYSTEM.stiffness, SYSTEM.mass
    state, now, side = np.array([0.015, 0.0]), 0.0, -1.0
    for i in np.flatnonzero(np.arange(time.size) % 500 == 499):
        while now < time[i]:
            end = time[i] if now >= 1.001 else min(time[i], 1.001)
            pull = 0.2 if now < 1.001 else -0.25

            def rate(_: float, y: np.ndarray, side: float = side, pull: float = pull) -> list[float]:
                return [y[1], (pull - c * y[1] - side * level - k * y[0]) / m]

            def stop(t: float, y: np.ndarray, side: float = side, now: float = now) -> float:
                return side * y[1] if t > now + 0.01 else 1.0

            stop.terminal = True  # type: ignore[attr-defined]
            step = solve_ivp(rate, (now, end), state, "DOP853", events=stop, rtol=1e-11, atol=1e-14)
            state, now = step.y[:, -1].copy(), float(step.t[-1])
            if step.status == 1:
                state[1], side = 0.0, -side
        assert motion.displacement[i] == pytest.approx(state[0], abs=1e-9)
        assert motion.velocity[i] == pytest.approx(state[1], abs=1e-7)


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
    still = np.zeros(TIME.size)
    with pytest.raises(InputError, match="one force a sample"):
        varying_friction_decay(SYSTEM, still, 0.01, 0.0, TIME, external_force=np.zeros(3))
    with pytest.raises(InputError, match="does not oscillate"):
        varying_friction_decay(SYSTEM, still, 0.01, 0.0, TIME, damping_ratio=1.0)
    with pytest.raises(InputError, match="pendulum"):
        varying_friction_decay(Pendulum(inertia=1.0, stiffness=1.0), np.full(3, 0.1), 0.1, 0.0, TIME[:3])
