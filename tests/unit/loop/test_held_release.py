"""Samples that were read before the mass was let go are no outliers of the sensor."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, short_decay
from experiments.ordinary.recipes import RECIPES
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.loop.data.prepared_record import cut_records, held_samples, rather_free


def held(count: int, quantity: str, seed: int) -> xr.DataArray:
    """A decay of 63 samples a period behind so many samples at rest where it was released."""
    moving = short_decay(quantity=quantity, noise_sd=0.0).values
    before = np.full(count, moving[0])
    noise = 2e-3 * np.max(np.abs(moving)) * np.random.default_rng(seed).standard_normal(moving.size + count)
    signal = np.concatenate([before, moving]) + noise
    return fb.make_record(np.arange(signal.size) / 100.0, signal, quantity, name="held.csv")


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize("count", [3, 10])
def test_the_decay_begins_behind_them(count: int, quantity: str, seed: int) -> None:
    """A longer hold is found with the decay, to a few samples."""
    decay = find_free_decay(held(count, quantity, seed), SYSTEM)
    begins = 100.0 * decay.start_time + held_samples(decay)
    assert count - 1.5 < begins < count + 2.5


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize("after", [0, 3, 10, 25, 40])
def test_a_record_that_begins_in_motion_has_none(after: int, quantity: str, seed: int) -> None:
    record = held(0, quantity, seed)
    assert held_samples(find_free_decay(record[after:], SYSTEM)) == 0


def test_a_far_swing_stays_long_where_it_turns_and_is_not_held(seed: int) -> None:
    pendulum = fb.Pendulum(inertia=0.1, stiffness=10.0)
    swing = {"initial_displacement": 2.0, "friction": 0.4, "noise_sd": 1e-3}
    assert held_samples(find_free_decay(short_decay(pendulum, seed=seed, **swing), pendulum)) == 0


def test_the_loop_leaves_them_out_and_says_so(seed: int) -> None:
    report = fb.close_loop([held(3, "displacement", seed)], SYSTEM, seed=1)
    assert any("samples before the release" in note for note in report.notes)
    assert report.fitted["from_s"] in (0.03, 0.04)
    outliers = sum(c["probability"] for c in report.candidates if "outliers" in c["effects"])
    assert outliers < 0.5
    low, high = report.friction_after["interval90"]
    # the middle 90 % widened to 99.7 %
    assert abs(report.friction_after["mean"] - 0.5) < 0.91 * (high - low)


@pytest.mark.parametrize("half_cycles", [12, 30])
def test_a_large_first_loss_is_a_hand_where_nothing_like_it_comes_later(
    half_cycles: int, rng: np.random.Generator
) -> None:
    """Of the first three half cycles each loses four times what a later one does.

    All are kept at first, as a law may explain them; in nine without it a random force would show.
    """
    angle = np.arange(0.0, half_cycles * np.pi, 0.1)
    half = np.floor(angle / np.pi).astype(int)
    loss = np.where(np.arange(half_cycles) < 3, 0.08, 0.02)
    before = 1.0 - np.concatenate([[0.0], np.cumsum(loss)[:-1]])
    side = np.where(half % 2 == 0, 1.0, -1.0)
    # a half cycle about its own centre, from one turning point to the next
    signal = side * 0.5 * loss[half] + (before - 0.5 * loss)[half] * np.cos(angle)
    system = fb.Oscillator(mass=1.0, stiffness=100.0)
    noisy = 0.01 * (signal + 2e-3 * rng.standard_normal(angle.size))
    record = fb.make_record(0.1 * angle, noisy, "displacement")
    assert find_free_decay(record, system).disturbed > 0
    (segment,) = cut_records([record], system)
    assert segment.decay.start_time < 0.03
    assert segment.disturbed > 0
    free = rather_free(segment)
    assert free is not None
    assert free.start_time > 0.9


@pytest.mark.parametrize(("entropy", "number", "until"), [((7, 8), 0, 0.37), ((17, 2), 2, 0.18)])
def test_what_removing_half_a_cycle_does_not_explain_removing_more_may(
    entropy: tuple[int, int], number: int, until: float
) -> None:
    """Of the first, two half cycles are suspected and three are the hand's; the other begins under it."""
    rng = np.random.default_rng(np.random.SeedSequence(entropy))
    held_at_first = RECIPES["hand at the start"](rng, number)
    record = fb.make_record(held_at_first.times, held_at_first.values, held_at_first.quantity)
    system = fb.Oscillator(mass=held_at_first.mass, stiffness=held_at_first.stiffness)
    free = rather_free(cut_records([record], system)[0])
    assert free is not None
    assert free.start_time == pytest.approx(until, abs=0.01)


@cache
def let_go_slowly() -> tuple[np.ndarray, float]:
    """Displacements, 100 a second, and friction; what holds the mass lets go over a sixth of a period."""
    omega, force, lets_go = 10.0, 5e-3, 0.1
    fine = 1e-4
    x, v, moving = 0.05, 0.0, [0.05]
    for k in range(60_000):
        hand = (
            0.5 * omega**2 * 0.05 * (1.0 + np.cos(np.pi * k * fine / lets_go)) if k * fine < lets_go else 0.0
        )
        spring = hand - omega**2 * x
        rubs = force * omega**2 * 0.1 * (np.sign(v) if v else np.sign(spring))
        change = spring - rubs if abs(spring) > abs(rubs) or v else 0.0
        after = v + fine * change
        v = 0.0 if v * after < 0.0 else after
        x += fine * v
        moving.append(x)
    first = int(0.4 * lets_go / fine)
    return np.array(moving[first::100]), force * omega**2 * 0.1


@pytest.mark.parametrize("seed", range(2))
def test_a_hand_that_lets_go_slowly_is_left_out(seed: int) -> None:
    """A force falls from what holds the mass to zero over a sixth of a period, the record starting within."""
    rng, (values, true) = np.random.default_rng(seed), let_go_slowly()
    record = fb.make_record(
        0.01 * np.arange(values.size), values + 2e-5 * rng.standard_normal(values.size), "displacement"
    )
    system = fb.Oscillator(mass=1.0, stiffness=100.0)
    offered = ["viscous_damping", "friction_drift", "cubic_stiffness", "sensor_offset", "random_force"]
    report = fb.close_loop([record], system, effects=offered)
    low, high = report.friction_after["interval90"]
    # the middle 90 % widened to 99.7 %
    assert abs(report.friction_after["mean"] - true) < 0.91 * (high - low)
    assert high - low < 0.01 * true
    with pytest.warns(fb.RecordWarning, match="is left out"):
        estimated = fb.estimate(record, system)
    low, high = estimated.friction.ppf([0.05, 0.95])
    assert abs(0.5 * (low + high) - true) < 0.91 * (high - low)
    assert high - low < 0.01 * true
