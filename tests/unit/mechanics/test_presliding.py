"""Pre-sliding without memory against SciPy with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.effects.presliding import PRESLIDING
from friction_bayes.mechanics.integrate import integrate

SYSTEM = Oscillator(mass=2.0, stiffness=200.0)
FRICTION = 0.3
RELEASE = 0.05
DISTANCE = 2e-4


def with_memory(time: np.ndarray) -> np.ndarray:
    """Half cycle by half cycle, each from its own turning point, whose place is remembered."""
    x, start, direction = RELEASE, 0.0, -1.0
    found = np.empty(time.size)
    while True:
        turn = x

        def slope(_: float, y: np.ndarray, turn: float = turn, direction: float = direction) -> list[float]:
            friction = FRICTION * (1.0 - 2.0 * np.exp(-abs(y[0] - turn) / DISTANCE))
            return [y[1], (-200.0 * y[0] - direction * friction) / 2.0]

        def stops(_: float, y: np.ndarray, direction: float = direction) -> float:
            return direction * y[1] + 1e-9

        stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            slope,
            (start, time[-1]),
            [turn, 0.0],
            "DOP853",
            events=stops,
            rtol=1e-10,
            atol=1e-12,
            dense_output=True,
        )
        inside = (time >= start) & (time <= run.t[-1])
        found[inside] = run.sol(time[inside])[0]
        if run.status == 0:
            return found
        x, start, direction = float(run.y[0, -1]), float(run.t[-1]), -direction


def test_speed_tells_the_distance_from_the_turning_point() -> None:
    time = np.linspace(0.0, 4.0, 2001)
    plain = integrate(SYSTEM, FRICTION, RELEASE, 0.0, time)
    ours = integrate(
        SYSTEM, FRICTION, RELEASE, 0.0, time, {"presliding.displacement": DISTANCE}, duration=4.0
    )
    exact = with_memory(time)
    effect = np.abs(exact - plain.displacement).max()
    assert effect > 1e-3
    np.testing.assert_allclose(ours.displacement, exact, atol=1e-5 * effect)


def test_half_periods_shorten_with_the_amplitude() -> None:
    time = np.linspace(0.0, 4.0, 2001)
    ours = integrate(SYSTEM, FRICTION, RELEASE, 0.0, time, {"presliding.displacement": DISTANCE})
    half = np.diff(ours.turning_times)
    assert np.all(half < np.pi / 10.0)
    assert np.all(np.diff(half)[:-1] < 0.0)


def test_it_comes_to_rest_in_the_dead_band() -> None:
    time = np.linspace(0.0, 20.0, 2001)
    ours = integrate(SYSTEM, FRICTION, RELEASE, 0.0, time, {"presliding.displacement": DISTANCE})
    assert ours.stop_time < 10.0
    assert abs(ours.displacement[-1]) <= FRICTION / 200.0


def test_a_friction_that_pushes_does_not_pre_slide() -> None:
    """The pull of the spring and such a friction cancel: the distance had no denominator."""
    force = PRESLIDING.force
    assert force(0.0, 1.0, -0.5, -1.0, -100.0, 1.0, 1.0, 100.0, np.array([0.02]), 0) == 0.0
    assert force(0.0, 1.0, -0.5, -1.0, 50.0, 1.0, 1.0, 100.0, np.array([0.02]), 0) > 0.0


@pytest.mark.parametrize("times", [1.05, 1.5, 3.0, 40.0])
@pytest.mark.parametrize("share", [0.003, 0.03, 0.3])
def test_the_force_is_that_of_the_distance_throughout_a_half_cycle(times: float, share: float) -> None:
    """From turning points of some amplitudes over the dead band, on both sides of it and of the centre."""
    mass, stiffness = 2.0, 200.0
    turn = times * FRICTION / stiffness
    length = share * turn
    for s in np.linspace(0.0, 2.0 * turn, 400)[1:]:
        built_up = 1.0 - 2.0 * math.exp(-s / length)
        work = s - 2.0 * length * -math.expm1(-s / length)
        energy = stiffness * s * (turn - 0.5 * s) - FRICTION * work
        if energy <= 0.0:
            break
        v = -math.sqrt(2.0 * energy / mass)
        force = PRESLIDING.force(
            0.0, turn - s, v, -1.0, FRICTION, 1.0, mass, stiffness, np.array([length]), 0
        )
        assert FRICTION * -1.0 + force == pytest.approx(-FRICTION * built_up, abs=1e-4 * FRICTION)
