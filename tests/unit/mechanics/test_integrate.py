"""The integrator against the exact solution and against scipy with events."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.mechanics.coulomb import coulomb_decay
from friction_bayes.mechanics.effects import force_effects, force_vector
from friction_bayes.mechanics.integrate import integrate, propagate

SYSTEM = Oscillator(mass=2.0, stiffness=800.0)
PENDULUM = Pendulum(inertia=0.8, stiffness=9.0)


def by_scipy(system, force, displacement, velocity, time):
    """Reference motion: DOP853 from one velocity zero to the next, ``force(t, x, v, s)`` in full."""
    t, state, end = time[0], [displacement, velocity], time[-1]
    out = np.full((2, time.size), np.nan)
    while True:
        if state[1] == 0.0:
            moves = [s for s in (-1.0, 1.0) if -s * force(t, state[0], 0.0, s) > 0.0]
            if not moves:
                out[:, time >= t] = [[state[0]], [0.0]]
                return out
            s = moves[0]
        else:
            s = math.copysign(1.0, state[1])

        def slope(t, y, s=s):
            return [y[1], -force(t, y[0], y[1], s) / system.moving]

        def reversal(t, y, s=s, start=t):
            return s * y[1] if t > start + 1e-6 else 1.0

        reversal.terminal = True
        part = solve_ivp(
            slope,
            (t, end),
            state,
            method="DOP853",
            dense_output=True,
            events=reversal,
            rtol=3e-14,
            atol=1e-15,
        )
        covered = (time >= t) & (time <= part.t[-1])
        out[:, covered] = part.sol(time[covered])
        if part.status == 0:
            return out
        t, state = part.t_events[0][0], [part.y_events[0][0][0], 0.0]


def largest_difference(motion, reference, amplitude, w0):
    return max(
        np.max(np.abs(motion.displacement - reference[0])) / amplitude,
        np.max(np.abs(motion.velocity - reference[1])) / (amplitude * w0),
    )


@pytest.mark.parametrize(("start", "velocity"), [(0.03, 0.0), (-0.02, 0.4)])
def test_a_hundred_half_cycles_within_1e_9_of_the_exact_solution(start, velocity):
    w0 = SYSTEM.natural_frequency
    amplitude = math.hypot(start, velocity / w0)
    friction = SYSTEM.stiffness * amplitude / 203.0
    time = np.linspace(3.0, 3.0 + 103 * math.pi / w0, 20_011)
    exact = coulomb_decay(SYSTEM, friction, start, velocity, time)
    motion = integrate(SYSTEM, friction, start, velocity, time)
    assert exact.turning_points.size >= 101
    assert math.isfinite(exact.stop_time)
    assert largest_difference(motion, (exact.displacement, exact.velocity), amplitude, w0) < 1e-9
    away = np.min(np.abs(time[:, None] - exact.turning_times), axis=1) > 1e-8
    assert np.max(np.abs(motion.acceleration - exact.acceleration)[away]) < 1e-9 * amplitude * w0**2
    np.testing.assert_allclose(motion.turning_times, exact.turning_times, atol=1e-9)
    np.testing.assert_allclose(motion.turning_points, exact.turning_points, atol=1e-9 * amplitude)
    assert motion.stop_time == pytest.approx(exact.stop_time, abs=1e-9)


R, M, K, T = 0.5, SYSTEM.mass, SYSTEM.stiffness, 4.0
W0 = SYSTEM.natural_frequency
TERMS = {
    "viscous_damping": (
        {"damping_ratio": 0.02},
        lambda t, x, v, s: K * x + R * s + 2 * 0.02 * W0 * M * v,
    ),
    "quadratic_drag": (
        {"drag_coefficient": 3.0},
        lambda t, x, v, s: K * x + R * s + 3.0 * v * abs(v),
    ),
    "asymmetric_friction": ({"asymmetry": -0.4}, lambda t, x, v, s: K * x + R * (1 - 0.4 * s) * s),
    "stribeck_friction": (
        {"static_excess": 0.8, "stribeck_velocity": 0.1},
        lambda t, x, v, s: K * x + R * s * (1 + 0.8 * math.exp(-((v / 0.1) ** 2))),
    ),
    "friction_drift": (
        {"relative_change": 1.1},
        lambda t, x, v, s: K * x + R * s * (1 + 1.1 * (t / T - 0.5)),
    ),
    "curved_friction_drift": (
        {"relative_change": -0.7, "time_share": 0.25},
        # of what is left to come, which falls to exp(-4), less its mean
        lambda t, x, v, s: (
            K * x
            + R * s * (1 + 0.7 * (math.exp(-4 * t / T) - 0.25 * (1 - math.exp(-4))) / (1 - math.exp(-4)))
        ),
    ),
    "stiffness_drift": (
        {"relative_change": 0.02},
        lambda t, x, v, s: K * x * (1 + 0.02 * (t / T - 0.5)) + R * s,
    ),
    "cubic_stiffness": ({"cubic_stiffness": 3e5}, lambda t, x, v, s: K * x + R * s + 3e5 * x**3),
    "position_friction": (
        {"slope": 8.0, "curvature": -1200.0},
        lambda t, x, v, s: K * x + R * s * (1 + 8.0 * x - 1200.0 * x * x),
    ),
    "position_force": (
        {"once_sine": 6.0, "twice_cosine": 0.9, "thrice_sine": -2.0, "four_times_cosine": 1.2},
        lambda t, x, v, s: (
            K * x
            + R * s
            + 6.0 * math.sin(x)
            + 0.9 * math.cos(2 * x)
            - 2.0 * math.sin(3 * x)
            + 1.2 * math.cos(4 * x)
        ),
    ),
}


def test_every_force_effect_of_the_package_has_a_reference():
    # that of pre-sliding remembers the turning point: test_presliding.py
    assert {effect.name for effect in force_effects()} == {*TERMS, "presliding"}


@pytest.mark.parametrize("name", sorted(TERMS))
def test_each_force_term_within_1e_8_of_scipy(name):
    parameters, force = TERMS[name]
    time = np.linspace(0.0, T, 2_001)
    reference = by_scipy(SYSTEM, force, 0.021, 0.1, time)
    effects = {f"{name}.{key}": value for key, value in parameters.items()}
    motion = integrate(SYSTEM, R, 0.021, 0.1, time, effects)
    assert largest_difference(motion, reference, 0.021, W0) < 1e-8
    plain = integrate(SYSTEM, R, 0.021, 0.1, time)
    assert np.max(np.abs(plain.displacement - motion.displacement)) > 1e-2 * 0.021


def test_all_terms_together_on_a_pendulum_at_large_angle():
    time = np.linspace(0.0, 30.0, 3_001)
    inertia, k = PENDULUM.inertia, PENDULUM.stiffness

    def force(t, x, v, s):
        level = 0.15 * (s * (1 + 0.5 * math.exp(-((v / 0.3) ** 2)) - 0.6 * (t / 30.0 - 0.5)) + 0.2)
        return (
            k * math.sin(x) + level + 2 * 0.01 * math.sqrt(k * inertia) * v + 0.02 * v * abs(v) + 0.3 * x**3
        )

    effects = {
        "viscous_damping.damping_ratio": 0.01,
        "quadratic_drag.drag_coefficient": 0.02,
        "asymmetric_friction.asymmetry": 0.2,
        "stribeck_friction.static_excess": 0.5,
        "stribeck_friction.stribeck_velocity": 0.3,
        "friction_drift.relative_change": -0.6,
        "cubic_stiffness.cubic_stiffness": 0.3,
    }
    motion = integrate(PENDULUM, 0.15, 2.8, 0.0, time, effects)
    reference = by_scipy(PENDULUM, force, 2.8, 0.0, time)
    assert largest_difference(motion, reference, 2.8, PENDULUM.natural_frequency) < 1e-8
    assert math.isfinite(motion.stop_time)


def test_frictionless_pendulum_keeps_its_energy_over_the_top():
    time = np.linspace(0.0, 20.0, 501)
    motion = integrate(PENDULUM, 0.0, 0.0, 8.0, time)
    kinetic = 0.5 * PENDULUM.inertia * motion.velocity**2
    energy = kinetic + PENDULUM.stiffness * (1 - np.cos(motion.displacement))
    assert motion.displacement[-1] > 10.0
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)


def test_acceleration_obeys_the_force_law_and_vanishes_at_rest():
    time = np.linspace(0.0, 6.0, 6_001)
    motion = integrate(SYSTEM, R, 0.021, 0.1, time, {"viscous_damping.damping_ratio": 0.02})
    x, v, a = motion.displacement, motion.velocity, motion.acceleration
    clear = np.abs(v) > 1e-9
    residual = M * a + K * x + R * np.sign(v) + 2 * 0.02 * W0 * M * v
    assert np.max(np.abs(residual[clear])) < 1e-12 * K
    rest = ~motion.moving
    assert rest.any()
    assert np.all(x[rest] == motion.turning_points[-1])
    assert not a[rest].any()


def test_a_motion_is_the_same_without_its_acceleration():
    time = np.linspace(0.0, 3.0, 200)
    decay = (time, 0.1, 0.5, 4.0, 2.0, 800.0, False, 3.0, force_vector({}), 1e-8)
    with_it, without = propagate(*decay, 2), propagate(*decay, 0)
    assert with_it[3].shape == time.shape
    assert without[3].size == 0
    assert with_it[6] == without[6] < 3.0
    for k in (0, 1, 2, 4, 5):
        np.testing.assert_array_equal(with_it[k], without[k])


def test_static_friction_holds_what_kinetic_friction_would_not():
    effects = {"stribeck_friction.static_excess": 1.0, "stribeck_friction.stribeck_velocity": 0.01}
    time = np.linspace(0.0, 1.0, 11)
    held = integrate(SYSTEM, R, 1.9 * R / K, 0.0, time, effects)
    released = integrate(SYSTEM, R, 2.1 * R / K, 0.0, time, effects)
    assert held.stop_time == 0.0
    assert released.displacement[1] < released.displacement[0]


def test_falling_friction_breaks_away_between_samples():
    # friction R (1.5 - t/2) meets the spring force 0.75 R at t = 1.5
    time = np.array([0.0, 0.9, 1.45, 1.8, 2.0])
    motion = integrate(SYSTEM, R, 0.75 * R / K, 0.0, time, {"friction_drift.relative_change": -1.0})
    assert np.all(motion.displacement[:3] == 0.75 * R / K)
    # after break-away the force falls at the rate R/2: x = x0 - (R/2K) (s - sin(w s)/w) while it slides
    since = np.array([0.3, 0.5])
    slid = R / (2.0 * K) * (since - np.sin(W0 * since) / W0)
    np.testing.assert_allclose(0.75 * R / K - motion.displacement[3:], slid, atol=1e-9 * R / K)
    assert math.isinf(motion.stop_time)


def test_a_friction_force_above_the_spring_stops_a_struck_mass():
    motion = integrate(SYSTEM, R, 0.0, 1e-3, np.linspace(0.0, 1.0, 101))
    assert motion.turning_points.size == 1
    assert 0.0 < motion.turning_points[0] < R / K


def test_the_compiled_integrator_is_cached_on_disk():
    code = (
        "from friction_bayes.mechanics.integrate import integrate, propagate\n"
        "from friction_bayes.core.system import Oscillator\n"
        "integrate(Oscillator(mass=2.0, stiffness=800.0), 0.5, 0.02, 0.0, [0.0, 1.0])\n"
        "import pickle, sys; sys.stdout.buffer.write(pickle.dumps(sum(propagate.stats.cache_hits.values())))"
    )
    integrate(SYSTEM, R, 0.02, 0.0, [0.0, 1.0])
    hits = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, check=True).stdout
    assert pickle.loads(hits) == 1


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ({"friction": -1.0}, "friction"),
        ({"initial_velocity": math.nan}, "initial_velocity"),
        ({"time": [1.0, 0.0]}, "time"),
        ({"rtol": 0.5}, "rtol"),
        ({"duration": 0.0}, "duration"),
        ({"effects": {"viscous_damping.damping_ratio": -0.1}}, "viscous_damping.damping_ratio"),
        ({"effects": {"sensor_offset.offset": 1.0}}, "effect sensor_offset"),
        ({"effects": {"cubic_stiffness.cubic_stiffness": -1e9}}, "motion"),
    ],
)
def test_bad_input_is_refused_by_name(arguments, place):
    defaults = {"friction": R, "initial_displacement": 0.02, "initial_velocity": 0.0, "time": np.arange(5.0)}
    with pytest.raises(InputError) as caught:
        integrate(SYSTEM, **(defaults | arguments))
    assert caught.value.place == place
