"""The exact Coulomb decay against the equation of motion and its conservation laws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from decays import SYSTEM
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.mechanics.coulomb import coulomb_decay

FRICTION = 0.07
DEADBAND = FRICTION / SYSTEM.stiffness
TIME = np.linspace(0.0, 36.0, 20_001)


def decay(displacement=0.0147, velocity=0.0, time=TIME, friction=FRICTION, system=SYSTEM):
    return coulomb_decay(system, friction, displacement, velocity, time)


@pytest.mark.parametrize(("displacement", "velocity"), [(0.0147, 0.0), (-0.011, 0.02), (0.003, -0.14)])
def test_equation_of_motion_holds_at_every_moving_sample(displacement, velocity):
    motion = decay(displacement, velocity)
    moving = motion.moving & (motion.velocity != 0.0)
    x, v, a = (motion.derivative(q)[moving] for q in range(3))
    # at a sample within rounding of a turning point the sign of the velocity is that of rounding
    clear = np.abs(v) > 1e-9
    residual = SYSTEM.mass * a + SYSTEM.stiffness * x + FRICTION * np.sign(v)
    assert np.max(np.abs(residual[clear])) < 1e-11
    assert clear.sum() > 10_000


def test_energy_lost_is_friction_times_path():
    motion = decay(0.002, 0.12)
    energy = 0.5 * SYSTEM.mass * motion.velocity**2 + 0.5 * SYSTEM.stiffness * motion.displacement**2
    corners = np.searchsorted(motion.turning_times, TIME, side="right")
    # path up to a sample: whole half cycles, and the piece since the last turning point
    points = np.concatenate([[0.002], motion.turning_points])
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points)))])
    travelled = path[corners] + np.abs(motion.displacement - points[corners])
    np.testing.assert_allclose(energy, energy[0] - FRICTION * travelled, atol=1e-13 * energy[0] * 100)


def test_amplitude_falls_by_two_deadbands_per_half_cycle_and_stops_inside_the_band():
    motion = decay()
    turns = motion.turning_points
    np.testing.assert_allclose(np.diff(np.abs(turns)), -2.0 * DEADBAND, rtol=1e-9)
    np.testing.assert_allclose(np.diff(motion.turning_times), math.pi / SYSTEM.natural_frequency, rtol=1e-12)
    assert abs(turns[-1]) <= DEADBAND < abs(turns[-2])
    assert motion.stop_time == motion.turning_times[-1]
    rest = ~motion.moving
    assert rest.any()
    assert np.all(motion.displacement[rest] == turns[-1])
    assert not motion.velocity[rest].any()
    assert not motion.acceleration[rest].any()


def test_acceleration_jumps_by_twice_friction_over_mass_at_a_turning_point():
    turn = decay().turning_times[3]
    around = decay(time=np.array([0.0, turn - 1e-9, turn + 1e-9]))
    jump = abs(around.acceleration[2] - around.acceleration[1])
    assert jump == pytest.approx(2.0 * FRICTION / SYSTEM.mass, rel=1e-5)


def test_displacement_and_velocity_are_continuous():
    motion = decay(-0.01, 0.05)
    step = TIME[1]
    w0 = SYSTEM.natural_frequency
    assert np.max(np.abs(np.diff(motion.displacement))) < 1.01 * step * w0 * 0.0122
    assert np.max(np.abs(np.diff(motion.velocity))) < 1.01 * step * w0**2 * 0.0122


def test_a_turning_point_on_the_edge_of_the_band_sticks():
    motion = decay(5.0 * DEADBAND)
    np.testing.assert_allclose(motion.turning_points, DEADBAND * np.array([5.0, -3.0, 1.0]), rtol=1e-12)
    assert motion.stop_time == pytest.approx(2.0 * math.pi / SYSTEM.natural_frequency)


@pytest.mark.parametrize("displacement", [0.0, DEADBAND, -DEADBAND])
def test_at_rest_inside_the_band_it_stays(displacement):
    motion = decay(displacement, time=TIME + 5.0)
    assert motion.stop_time == 5.0
    assert np.all(motion.displacement == displacement)
    assert not motion.acceleration.any()


def test_struck_inside_the_band_it_moves_and_sticks_at_its_first_turning_point():
    motion = decay(0.0, 1e-4)
    assert motion.turning_points.size == 1
    assert 0.0 < motion.turning_points[0] < DEADBAND
    lost = 0.5 * SYSTEM.mass * 1e-8 - 0.5 * SYSTEM.stiffness * motion.turning_points[0] ** 2
    assert lost == pytest.approx(FRICTION * motion.turning_points[0], rel=1e-12)


def test_without_friction_it_is_a_cosine():
    motion = decay(0.01, 0.03, friction=0.0)
    w0 = SYSTEM.natural_frequency
    np.testing.assert_allclose(
        motion.displacement, 0.01 * np.cos(w0 * TIME) + 0.03 / w0 * np.sin(w0 * TIME), atol=1e-15 * 360
    )
    assert math.isinf(motion.stop_time)


def test_rotation_is_the_same_equation():
    turning = Oscillator(inertia=10.0, stiffness=1000.0)
    np.testing.assert_array_equal(decay(system=turning).displacement, decay().displacement)


def test_envelope_slope_both_ways():
    motion = decay()
    slope = -np.diff(np.abs(motion.turning_points[:-1])) / np.diff(motion.turning_times[:-1])
    np.testing.assert_allclose(slope, SYSTEM.envelope_slope(FRICTION), rtol=1e-9)
    assert SYSTEM.friction_from_slope(slope[0]) == pytest.approx(FRICTION, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ({"friction": -0.1}, "friction"),
        ({"friction": math.nan}, "friction"),
        ({"displacement": math.inf}, "initial_displacement"),
        ({"displacement": 1e308, "system": Oscillator(mass=1e-3, stiffness=1e3)}, "initial state"),
        ({"velocity": "fast"}, "initial_velocity"),
        ({"time": [0.0, 2.0, 1.0]}, "time"),
        ({"time": [0.0, math.nan]}, "time"),
        ({"time": []}, "time"),
        ({"time": [0.0, 1e12]}, "time"),
        ({"system": Pendulum(inertia=1.0, stiffness=1.0)}, "system"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, place):
    with pytest.raises(InputError) as caught:
        decay(**arguments)
    assert caught.value.place == place
    assert "\n" not in str(caught.value)
