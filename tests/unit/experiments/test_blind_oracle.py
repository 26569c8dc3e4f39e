from __future__ import annotations

import math

import numpy as np
import pytest

from experiments.blind.along_motion import FRICTION, Path, covariance, effect_columns, nuisance_columns
from experiments.blind.disturbed_motion import integrate_disturbed
from experiments.blind.fluctuating import draw_fluctuating
from experiments.blind.forward import decay_signal
from experiments.blind.laws import Law
from experiments.blind.oracle import judge


def drawn(kind: str, seed: int, quantity: str, with_force: bool = True):
    shift = 0
    while (sealed := draw_fluctuating(kind, seed + shift, with_force=with_force)).truth.quantity != quantity:
        shift += 1
    return sealed


@pytest.mark.parametrize("order", [0, 2])
def test_covariance_is_that_of_duhamels_integral(order: int) -> None:
    sd, correlation_time, fine = 0.3, 0.4, 0.01
    t = fine * np.arange(1001)
    force = sd**2 * np.exp(-np.abs(t[:, None] - t) / correlation_time)
    weights = np.where(t[:, None] > t, fine * np.sin(t[:, None] - t), 0.0)
    weights[:, 0] *= 0.5
    if order == 2:
        weights = np.eye(t.size) - weights
    times = t[::25]
    expected = (weights @ force @ weights.T)[::25, ::25] + 0.01 * np.eye(times.size)
    ours = covariance(times, order, sd, correlation_time, np.full(times.size, 0.01))
    np.testing.assert_allclose(ours, expected, rtol=0, atol=2e-4 * np.max(expected))


@pytest.mark.parametrize("order", [0, 2])
def test_the_true_law_along_the_true_motion_is_the_signal(order: int) -> None:
    law = Law(friction=0.01, drag=0.004, cubic=0.05, relative_change=0.4, duration=60.0)
    motion = integrate_disturbed(law, 1.0, 0.0, 0.01, np.zeros(6001))
    # not at the turning points, where an acceleration jumps within a stretch
    times = np.arange(0.0, 59.0, 0.05)
    path = Path(motion, times, order)
    signal = motion.sample(times)[order // 2]
    start = nuisance_columns(path)[0]
    np.testing.assert_allclose(path.response(path.law()) + start, signal, rtol=0, atol=5e-4)


def test_a_position_force_is_eight_columns_of_a_wide_swing() -> None:
    sines, cosines = (0.002, 0.0, -0.001, 0.001), (0.0, -0.003, 0.0, 0.001)
    law = Law(friction=0.01, swing=4.0, turn_sines=sines, turn_cosines=cosines)
    motion = integrate_disturbed(law, 1.0, 0.0, 0.01, np.zeros(6001))
    path = Path(motion, np.arange(0.0, 59.0, 0.05), 0)
    (columns,) = effect_columns(path, 4.0)["position_force"]
    signal = law.friction * nuisance_columns(path)[FRICTION] + columns @ np.array([*sines, *cosines])
    np.testing.assert_allclose(signal, path.response(path.law()), rtol=0, atol=1e-9)
    # within less than half a turn it is a bent spring
    assert "position_force" not in effect_columns(path, 1.5)
    assert "position_force" not in effect_columns(path, None)


def test_a_strong_position_force_of_a_wide_swing_has_no_rival(seed: int) -> None:
    shift, strong = 0, False
    while not strong:
        sealed = draw_fluctuating("position_force", seed + shift, with_force=False)
        of = sealed.truth.parameters
        strong = of["swing"] > 3.0 and of["position_force_over_friction"] > 0.5
        shift += 1
    judged = judge(sealed)
    assert judged.loss > 10.0
    assert 0.0 < judged.friction_sd < 0.1


def test_friction_without_a_force_is_as_uncertain_as_the_law_says(seed: int) -> None:
    sealed = drawn("plain_coulomb", seed, "displacement", with_force=False)
    used = sealed.times < sealed.rest_time
    times, motion = sealed.times[used], sealed.motion
    at = np.zeros(11)
    at[:4] = 1.0, motion.law.friction, *sealed.start
    at[8] = math.log(0.2)
    columns = []
    for i in range(4):
        step = np.zeros(11)
        step[i] = 1e-5
        ends = [decay_signal(at + sign * step, times, motion.law.duration, 0) for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / 2e-5 / sealed.noise_sd)
    jacobian = np.column_stack(columns)
    sd = math.sqrt(np.linalg.inv(jacobian.T @ jacobian)[1, 1]) / motion.law.friction
    assert judge(sealed).friction_sd == pytest.approx(sd, rel=0.1)


def test_a_force_that_fluctuates_widens_what_can_be_said_of_friction(seed: int) -> None:
    with_force, without = (drawn("plain_coulomb", seed, "angle", with_force=f) for f in (True, False))
    assert judge(with_force).friction_sd > 2.0 * judge(without).friction_sd
    assert judge(with_force).force_loss > judge(without).force_loss == 0.0


def test_the_same_signal_is_no_other_explanation(seed: int) -> None:
    judged = judge(drawn("asymmetric_friction", seed, "displacement"))
    assert judged.loss < 0.1
    assert judged.rival <= {"sensor_offset", "sensor_drift"}


def test_a_plain_record_has_no_rival_and_flat_samples_are_seen(seed: int) -> None:
    assert judge(draw_fluctuating("plain_coulomb", seed)).loss == math.inf
    assert judge(draw_fluctuating("sensor_clipping", seed)).loss == math.inf


def test_a_judge_who_knows_the_second_mode_knows_friction_beside_it(seed: int) -> None:
    judged = judge(draw_fluctuating("second_mode", seed))
    assert 0.0 < judged.friction_sd < 1.0
    assert judged.loss > 0.0
    assert "second_mode" not in judged.rival
