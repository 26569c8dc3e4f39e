from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from experiments.blind.disturbed_motion import integrate_disturbed
from experiments.blind.fluctuating import FLUCTUATING_KINDS, RANDOM_FORCE, draw_fluctuating
from experiments.blind.laws import Law, integrate, turn_waves
from experiments.blind.ornstein_uhlenbeck import ornstein_uhlenbeck
from experiments.blind.sensor_faults import with_sensor

LAW = Law(
    friction=0.009,
    damping_ratio=0.001,
    drag=0.002,
    asymmetry=0.3,
    static_excess=0.8,
    stribeck_velocity=0.2,
    relative_change=0.5,
    cubic=0.05,
    duration=100.0,
)
SMALLEST_NOISE = 0.35 * 10.0 ** (-34.0 / 20.0)  # of any record: its motion's root mean square is above 0.35


def test_without_a_force_the_motion_is_that_of_dop853() -> None:
    step = 0.01
    t = np.arange(0.0, 100.0, 0.037)
    ours = integrate_disturbed(LAW, 0.6, -0.8, step, np.zeros(10001))
    reference = integrate(LAW, 0.6, -0.8, 100.0)
    np.testing.assert_allclose(ours.turning_times, reference.turning_times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(ours.sample(t)[0], reference.sample(t)[0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(ours.sample(t)[1], reference.sample(t)[1], rtol=0, atol=1e-5)


def test_rest_is_found_where_dop853_finds_it() -> None:
    law = Law(friction=0.0202)
    ours = integrate_disturbed(law, 1.0, 0.0, 0.01, np.zeros(12001))
    assert ours.rest_time == pytest.approx(25 * math.pi, abs=1e-6)
    x, acceleration = ours.sample(np.array([26 * math.pi]))
    # 1 - 2 d n at the 25th turning point, on the other side
    assert x[0] == pytest.approx(0.01, abs=1e-6)
    assert acceleration[0] == 0.0


def test_a_strong_force_frees_a_mass_that_has_stuck() -> None:
    force = np.zeros(4001)
    force[2000:] = 0.5
    motion = integrate_disturbed(Law(friction=0.1), 0.05, 0.0, 0.01, force)
    x, _ = motion.sample(np.array([19.0, 20.0 + math.pi]))
    assert x[0] == pytest.approx(0.05)
    # half a swing about 0.5 - 0.1
    assert x[1] == pytest.approx(0.75, abs=0.01)


def test_motion_under_a_force_agrees_with_a_dense_solution(rng: np.random.Generator) -> None:
    step, n = 0.01, 2001
    force = ornstein_uhlenbeck(rng, 0.5 * LAW.friction, 0.2, step, n)
    grid = step * np.arange(n)
    motion = integrate_disturbed(LAW, 0.6, -0.8, step, force)

    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        # direction of the motion is taken from ours; between turning points it does not change
        sign = -1.0 if np.searchsorted(motion.turning_times, t, side="right") % 2 == 0 else 1.0
        return y[1], LAW.acceleration(t, y[0], y[1], sign, 0) + float(np.interp(t, grid, force))

    dense = solve_ivp(
        slope, (0.0, 20.0), (0.6, -0.8), max_step=step, rtol=1e-9, atol=1e-11, dense_output=True
    )
    t = np.arange(0.0, 19.9, 0.043)
    np.testing.assert_allclose(motion.sample(t)[0], dense.sol(t)[0], rtol=0, atol=2e-6)


@pytest.mark.parametrize("periods", [0.01, 1.0])
def test_the_grid_is_fine_enough_for_the_shortest_correlation(
    rng: np.random.Generator, periods: float
) -> None:
    correlation_time = 2.0 * math.pi * periods
    step, finer = min(0.01, correlation_time / 20.0), 8
    n = int(20.0 * math.pi / step)
    law = Law(friction=0.009)
    fine = ornstein_uhlenbeck(rng, 0.6 * law.friction, correlation_time, step / finer, (n - 1) * finer + 1)
    t = np.arange(0.0, 19.0 * math.pi, 0.03)
    coarse_x, coarse_a = integrate_disturbed(law, 1.0, 0.0, step, fine[::finer]).sample(t)
    fine_x, fine_a = integrate_disturbed(law, 1.0, 0.0, step / finer, fine).sample(t)
    # what the finer path has between the points, integrated; it grows as the square root of time, and the
    # longest record is five times as long
    assert np.max(np.abs(coarse_x - fine_x)) < 0.05 * SMALLEST_NOISE
    # an acceleration contains the force itself; its values between the points are a sixth of its sd off
    jumps = np.abs(coarse_a - fine_a)
    assert np.sqrt(np.mean(np.minimum(jumps, law.friction) ** 2)) < 0.15 * SMALLEST_NOISE


def test_presliding_is_the_dahl_model() -> None:
    law = Law(friction=0.02, presliding=0.01)
    motion = integrate_disturbed(law, 1.0, 0.0, 0.01, np.zeros(6001))

    def dahl(_: float, y: np.ndarray) -> tuple[float, float, float]:
        x, v, s = y
        return v, -x - law.friction * s, v / law.presliding * (1.0 - s * np.sign(v))

    dense = solve_ivp(
        dahl, (0.0, 59.0), (1.0, 0.0, -1.0), max_step=0.002, rtol=1e-8, atol=1e-10, dense_output=True
    )
    t = np.arange(0.0, 59.0, 0.1)
    np.testing.assert_allclose(motion.sample(t)[0], dense.sol(t)[0], rtol=0, atol=2e-4)


def test_the_force_has_its_sd_and_correlation(rng: np.random.Generator) -> None:
    sd, correlation_time, step, n = 0.3, 0.5, 0.05, 200_000
    path = ornstein_uhlenbeck(rng, sd, correlation_time, step, n)
    memory = math.exp(-step / correlation_time)
    # a stationary autoregression: relative variance of its mean square 2 (1 + a^2) / (1 - a^2) / n
    error = math.sqrt(2.0 * (1.0 + memory**2) / (1.0 - memory**2) / n)
    assert abs(np.mean(path**2) / sd**2 - 1.0) < 4.5 * error
    innovations = path[1:] - memory * path[:-1]
    assert abs(np.corrcoef(innovations, path[:-1])[0, 1]) < 4.5 / math.sqrt(n)
    assert np.var(innovations) == pytest.approx(sd**2 * (1.0 - memory**2), rel=4.5 * math.sqrt(2.0 / n))


def test_backlash_and_held_counts_lag_behind_by_their_half_width() -> None:
    t = np.linspace(0.0, 20.0, 20_001)
    x, direction = np.cos(t), -np.sign(np.sin(t))
    far = np.abs(np.sin(t)) > 0.3
    backlash = with_sensor(x, t, 0.7, 1.0, {"backlash": 0.02})
    np.testing.assert_allclose((backlash - x)[far], -0.02 * direction[far], rtol=0, atol=1e-12)
    held = with_sensor(x, t, 0.7, 1.0, {"held_counts": 0.02})
    lag = (held - x)[far] * direction[far]
    assert lag.max() < 1e-9
    assert lag.min() > -0.04
    assert lag.mean() == pytest.approx(-0.02, abs=0.001)


def test_a_bent_scale_reads_one_side_too_long_and_the_other_too_short() -> None:
    t = np.linspace(0.0, 20.0, 2001)
    bent = {"scale_square": -0.02, "scale_cube": 0.04}
    error = with_sensor(np.cos(t), t, 0.7, 1.0, bent) - np.cos(t)
    # half of the square moves the centre, three quarters of the cube make the scale longer
    expected = -0.01 - 0.01 * np.cos(2.0 * t) + 0.03 * np.cos(t) + 0.01 * np.cos(3.0 * t)
    np.testing.assert_allclose(error, expected, rtol=0, atol=1e-12)


def test_eccentricity_is_locked_to_the_angle() -> None:
    t = np.linspace(0.0, 20.0, 2001)
    x = np.cos(t)
    drawn = {"once_a_turn": 0.05, "once_phase": 0.3, "twice_a_turn": 0.02, "twice_phase": 1.0}
    error = with_sensor(x, t, 0.7, 3.0, drawn) - x
    expected = 0.7 * (0.05 * np.sin(3.0 * x + 0.3) + 0.02 * np.sin(6.0 * x + 1.0))
    np.testing.assert_allclose(error, expected, rtol=0, atol=1e-12)


def test_a_position_force_keeps_the_energy() -> None:
    sines, cosines = (0.02, 0.0, -0.01, 0.01), (0.0, -0.03, 0.0, 0.01)
    law = Law(friction=0.0, swing=4.0, turn_sines=sines, turn_cosines=cosines)
    motion = integrate_disturbed(law, 1.0, 0.0, 0.01, np.zeros(6001))
    energy = 0.5 * (motion.v**2 + motion.x**2)
    for n, (sine, cosine) in enumerate(zip(sines, cosines, strict=True), 1):
        angle = n * law.swing * motion.x
        energy += (cosine * np.sin(angle) - sine * np.cos(angle)) / (n * law.swing)
    np.testing.assert_allclose(energy, energy[0], rtol=0, atol=1e-7)
    # not so without it
    assert np.ptp(motion.v**2 + motion.x**2) > 1e-3
    np.testing.assert_allclose(
        integrate(law, 1.0, 0.0, 60.0).sample(motion.times)[0], motion.x, rtol=0, atol=1e-6
    )


def test_a_position_force_is_of_the_drawn_size_along_the_motion(seed: int) -> None:
    sizes = []
    for shift in range(6):
        sealed = draw_fluctuating("position_force", seed + shift, with_force=False)
        truth, drawn = sealed.truth, sealed.truth.parameters
        amplitude = truth.friction / sealed.system["stiffness"] / drawn["friction"]
        assert truth.quantity == "angle"
        assert truth.visible == ("position_force",)
        assert amplitude == pytest.approx(drawn["swing"])
        assert 0.5 * math.pi <= drawn["swing"] <= 6.0
        assert 0.1 <= drawn["position_force_over_friction"] <= 1.0
        angle = amplitude * sealed.motion.sample(sealed.times[sealed.times < sealed.rest_time])[0]
        force = np.array([*drawn["turn_sines"], *drawn["turn_cosines"]]) @ turn_waves(angle)
        over_friction = math.sqrt(np.mean(force**2)) / drawn["friction"]
        sizes.append(over_friction / drawn["position_force_over_friction"])
    # it is drawn along the decay without it, whose rest it moves
    np.testing.assert_allclose(sizes, 1.0, rtol=0, atol=0.05)


def test_jitter_widens_the_noise_where_the_signal_is_fast(seed: int) -> None:
    offset = 0
    while (sealed := draw_fluctuating("timing_jitter", seed + offset)).truth.quantity == "acceleration":
        offset += 1  # whose jumps at the turning points are no slope
    scale = sealed.truth.noise_sd / sealed.noise_sd
    residual = (sealed.record.values / scale - sealed.clean) / sealed.noise_sd
    speed = np.gradient(sealed.clean, sealed.times)
    jitter = sealed.truth.parameters["timing_jitter"]
    sd = np.sqrt(1.0 + (speed * jitter / sealed.noise_sd) ** 2)
    moving = sealed.times < sealed.rest_time
    z = (residual / sd)[moving]
    assert abs(np.mean(z**2) - 1.0) < 4.5 * math.sqrt(2.0 / z.size)


@pytest.mark.parametrize("kind", FLUCTUATING_KINDS)
def test_every_kind_is_drawn_with_a_force(kind: str, seed: int) -> None:
    sealed = draw_fluctuating(kind, np.random.SeedSequence(seed))
    truth = sealed.truth
    assert RANDOM_FORCE in truth.effects
    assert RANDOM_FORCE in truth.visible
    assert "disturbed_release" not in truth.effects
    assert 0.05 <= truth.parameters["force_over_friction"] <= 0.6
    assert truth.parameters["force_sd"] == truth.parameters["force_over_friction"] * truth.friction
    assert np.all(np.isfinite(sealed.record))
    assert set(sealed.record.attrs) == {"quantity", "units", "name", "synthetic"}


def test_the_same_seed_draws_the_same_record(seed: int) -> None:
    sequence = np.random.SeedSequence(seed)
    sealed, again = (draw_fluctuating("viscous_damping", sequence) for _ in range(2))
    np.testing.assert_array_equal(sealed.record, again.record)


def test_without_a_force_nothing_fluctuates(seed: int) -> None:
    truth = draw_fluctuating("backlash", seed, with_force=False).truth
    assert truth.effects == ("sensor_hysteresis",)
    assert "force_sd" not in truth.parameters


def test_the_hand_is_gone_when_it_has_let_go(seed: int) -> None:
    sealed = draw_fluctuating("disturbed_release", seed, with_force=False)
    grid = sealed.motion.step * np.arange(sealed.motion.force.size)
    until = sealed.truth.parameters["hand_until"]
    assert np.all(sealed.motion.force[grid >= until] == 0.0)
    assert np.max(np.abs(sealed.motion.force)) > sealed.truth.parameters["friction"]
