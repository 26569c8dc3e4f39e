from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from experiments.ordinary.coulomb_motion import CoulombMotion
from experiments.ordinary.forced_motion import ForcedMotion
from experiments.ordinary.loads import (
    hand,
    ornstein_uhlenbeck_force,
    pink_friction,
    redrawn_friction,
    rough_friction,
    steady_friction,
    telegraph_friction,
)
from experiments.ordinary.rig import SENSORS, Rig

RIG = Rig(mass=2.0, stiffness=50.0, friction=0.4)  # 5 rad/s, r/k = 8 mm
STEP = RIG.period / 400.0
SHARE = 0.4


def test_each_half_cycle_takes_twice_friction_over_stiffness() -> None:
    points = CoulombMotion(RIG, -0.1).turning_points
    np.testing.assert_allclose(np.abs(points), [0.1, 0.084, 0.068, 0.052, 0.036, 0.02, 0.004], atol=1e-15)
    assert np.all(np.sign(points[:-1]) == (-1.0) ** np.arange(1, 7))


def test_the_exact_decay_obeys_its_equation_of_motion(rng: np.random.Generator) -> None:
    motion = CoulombMotion(RIG, 0.1)
    t = rng.uniform(0.0, 6.0 * math.pi / RIG.frequency, 200)
    x, v, a = (motion.sample(t, sensor) for sensor in SENSORS)
    np.testing.assert_allclose(2.0 * a + 0.4 * np.sign(v) + 50.0 * x, 0.0, atol=1e-12)
    h = 1e-6
    slope = (motion.sample(t + h, "displacement") - motion.sample(t - h, "displacement")) / (2.0 * h)
    np.testing.assert_allclose(v, slope, atol=1e-5)


def test_the_mass_is_held_before_the_release_and_stays_in_the_end() -> None:
    motion = CoulombMotion(RIG, 0.1)
    t = np.array([-1.0, 6.001 * math.pi / RIG.frequency, 100.0])
    # six half cycles of 16 mm
    np.testing.assert_allclose(motion.sample(t, "displacement"), [0.1, 0.004, 0.004], atol=1e-12)
    assert not np.any(motion.sample(t, "velocity"))
    assert not np.any(motion.sample(t, "acceleration"))


@pytest.mark.parametrize("sensor", SENSORS)
def test_steps_agree_with_the_exact_decay(sensor: str) -> None:
    exact = CoulombMotion(RIG, 0.1)
    stepped = ForcedMotion(RIG, steady_friction(0.4), np.zeros(2000), STEP, 0.1)
    np.testing.assert_allclose(
        stepped.turning_times, math.pi / RIG.frequency * np.arange(1, 7), rtol=0, atol=1e-8
    )
    t = np.arange(-0.5, 1999 * STEP, 0.0137)
    np.testing.assert_allclose(stepped.sample(t, sensor), exact.sample(t, sensor), rtol=0, atol=2e-6)


def frictions(rng: np.random.Generator) -> dict[str, object]:
    return {
        "redrawn": redrawn_friction(rng, 0.4, SHARE, 30),
        "telegraph": telegraph_friction(rng, 0.4, SHARE, RIG.period, 4000 * STEP),
        "pink": pink_friction(rng, 0.4, SHARE, STEP, 4000),
        "rough": rough_friction(rng, 0.4, SHARE, 0.05),
    }


@pytest.mark.parametrize("kind", ["redrawn", "telegraph", "pink", "rough"])
def test_what_friction_takes_is_what_the_energy_loses(kind: str, rng: np.random.Generator) -> None:
    motion = ForcedMotion(RIG, frictions(rng)[kind], np.zeros(4000), STEP, 0.2)
    end = motion.turning_times[5]
    # path from turning point to turning point, so that travel is a sum of differences
    ends = np.array([0.0, *motion.turning_times[:6]])
    x = motion.sample(ends, "displacement")
    lost = 25.0 * (x[0] ** 2 - x[-1] ** 2)
    travel = np.sum(np.abs(np.diff(x)))
    assert motion.mean_friction(0.0, end) == pytest.approx(lost / travel, rel=2e-3)
    each = [motion.mean_friction(start, stop) for start, stop in pairwise(ends)]
    assert np.max(np.abs(np.array(each) / 0.4 - 1.0)) > 1e-4


def test_a_force_does_the_work_that_the_energy_gains(rng: np.random.Generator) -> None:
    force = ornstein_uhlenbeck_force(rng, 0.3, 0.5, STEP, 1500) + hand(2.0, 1.0, STEP, 1500)
    motion = ForcedMotion(RIG, steady_friction(0.4), force, STEP, 0.2)
    t = np.arange(0.0, 1.7, STEP / 20.0)
    x, v = motion.sample(t, "displacement"), motion.sample(t, "velocity")
    energy = 25.0 * x**2 + v**2
    power = np.interp(t, STEP * np.arange(1500), force) * v - 0.4 * np.abs(v)
    work = np.sum(0.5 * (power[1:] + power[:-1])) * STEP / 20.0
    assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-4 * energy[0])
    assert motion.mean_friction(0.0, 1.7) == pytest.approx(0.4)


def test_a_mass_that_sticks_is_freed_by_a_force_above_friction() -> None:
    force = np.zeros(2000)
    force[1000:] = 1.0
    motion = ForcedMotion(RIG, steady_friction(0.4), force, STEP, 0.007)
    x = motion.sample(np.array([999.0, 1000.0 + 200.0]) * STEP, "displacement")
    # half a swing about (1 - 0.4) / 50 from 7 mm
    np.testing.assert_allclose(x, [0.007, 0.017], atol=1e-4)


def test_the_random_force_has_its_size_and_memory(rng: np.random.Generator) -> None:
    path = ornstein_uhlenbeck_force(rng, 0.5, 0.1, 0.01, 400_000)
    # 20,000 correlation times: the sd of a variance is 1/sqrt(20000), of a correlation less; five of them
    assert path.var() == pytest.approx(0.25, rel=0.035)
    lagged = np.mean(path[10:] * path[:-10]) / path.var()
    assert lagged == pytest.approx(math.exp(-1.0), abs=0.035)


def test_pink_friction_falls_by_ten_decibels_a_decade(rng: np.random.Generator) -> None:
    n = 2**14
    friction = pink_friction(rng, 1.0, 0.1, 1.0, n)
    path = np.array([friction(float(i), 0.0, 0) for i in range(n - 1)])
    assert path.std() == pytest.approx(0.1, rel=0.02)
    power = np.abs(np.fft.rfft(path)) ** 2
    low, high = power[20:40].mean(), power[2000:4000].mean()
    # the mean of 20 exponential variates: sd 22 %, four of them
    assert low / high == pytest.approx(100.0, rel=0.9)


def test_telegraph_and_redrawn_friction_keep_their_levels(rng: np.random.Generator) -> None:
    telegraph = telegraph_friction(rng, 2.0, 0.25, 1.0, 1000.0)
    seen = np.array([telegraph(t, 0.0, 0) for t in np.arange(0.0, 1000.0, 0.01)])
    assert set(seen.tolist()) == {1.5, 2.5}
    # 1000 jumps, Poisson: five standard deviations
    assert np.count_nonzero(np.diff(seen)) == pytest.approx(1000, abs=160)
    redrawn = redrawn_friction(rng, 2.0, 0.25, 2000)
    levels = np.array([redrawn(0.0, 0.0, i) for i in range(2000)])
    assert levels.std() == pytest.approx(0.5, rel=0.08)
    assert redrawn(0.0, 0.0, 7) == redrawn(3.0, 1.0, 7)


def test_rough_friction_depends_on_the_place_alone(rng: np.random.Generator) -> None:
    rough = rough_friction(rng, 2.0, 0.2, 0.01)
    levels = np.array([rough(0.0, x, 0) for x in np.linspace(0.0, 10.0, 20_000)])
    assert levels.mean() == pytest.approx(2.0, rel=0.01)
    assert levels.std() == pytest.approx(0.4, rel=0.02)
    assert rough(0.0, 0.3, 0) == rough(9.0, 0.3, 5)
