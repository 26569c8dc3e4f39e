"""Rounds until a law has converged: a step that leads too far is halved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

import friction_bayes as fb
from experiments import loop_ordinary
from experiments.blind.prior_drawn import AddedLaw, Sensor, measure, move, release
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.loop.infer.rounds import _law_along
from friction_bayes.mechanics.effects import EFFECTS

FRICTION, DAMPING = 0.0325, 0.021
"""Friction over stiffness and amplitude, and the ratio."""
START, HALF_CYCLES, SAMPLES_PER_PERIOD, NOISE = 2.172, 11, 45.3, 0.0034


def test_steps_that_go_to_and_fro_converge() -> None:
    """Whole steps about this motion end anywhere, with a random force that makes up for it."""
    law = AddedLaw(friction=FRICTION, damping_ratio=DAMPING, duration=math.pi * HALF_CYCLES)
    motion = move(law, release(START), None, np.random.default_rng(0))
    times = np.arange(0.0, law.duration, 2.0 * math.pi / SAMPLES_PER_PERIOD)[:-1]
    values, _ = measure(motion, Sensor(order=2), times, NOISE, np.random.default_rng(41))
    record = fb.make_record(times, values, "acceleration", synthetic=True)
    rivals = ["viscous_damping", "quadratic_drag", "friction_drift", "presliding", "random_force"]
    report = fb.close_loop([record], fb.Oscillator(mass=1.0, stiffness=1.0), seed=1, effects=rivals)
    assert report.candidates[0]["effects"] == ["viscous_damping"]
    assert report.noise["sd"] == pytest.approx(NOISE, rel=0.15)
    low, high = report.friction_after["interval90"]
    assert low < FRICTION < high
    assert high - low < 0.1 * FRICTION


def test_samples_that_are_set_aside_leave_effects_of_one_column() -> None:
    """Fewer samples than columns are no reason to refuse a record."""
    record = fb.simulate(
        fb.Oscillator(inertia=1.0, stiffness=1.0),
        friction=0.05,
        initial_displacement=2.0,
        duration=28.0,
        sampling_rate=3.6,
        noise_sd=0.01,
        seed=1,
    )
    system = fb.Oscillator(inertia=1.0, stiffness=1.0)
    (segment,) = cut_records([record], system)
    whole = MovingRecord.of(segment, system, tuple(EFFECTS), scales_of([segment], system))
    w0, motion = whole.first_motion()
    aside = np.arange(whole.samples) % 2 == 1
    all_of_them = LawAlongMotion.of(whole.setting_aside(aside), motion, w0, ())
    assert all_of_them is not None
    assert not all_of_them.determined
    fewer, along = _law_along(whole, aside, motion, w0, (), None)
    assert along is not None
    assert along.determined
    assert set(fewer.effects) < set(whole.effects)


@pytest.mark.parametrize("noise", [2e-6, 2e-7])
def test_damping_beside_presliding_is_not_taken_for_a_friction_drift(noise: float) -> None:
    """Pre-sliding acts over a distance that depends on friction, not on what else takes energy.

    At that of the loss friction was .1 % high, by five standard deviations of the larger noise.
    """
    system = fb.Oscillator(mass=1.0, stiffness=100.0)
    record = fb.simulate(
        system,
        friction=0.05,
        initial_displacement=0.01,
        duration=8.0,
        sampling_rate=100.0,
        noise_sd=noise,
        seed=1,
        effects={"presliding.displacement": 6e-4, "viscous_damping.damping_ratio": 2e-3},
    )
    offered = (
        "viscous_damping",
        "friction_drift",
        "curved_friction_drift",
        "presliding",
        "stribeck_friction",
    )
    report = fb.close_loop([record], system, effects=offered)
    assert report.candidates[0]["effects"] == ["viscous_damping", "presliding"]
    found = report.friction_after
    assert found["sd"] < 8.0 * noise
    assert found["mean"] == pytest.approx(0.05, abs=3.5 * found["sd"])


def test_few_samples_of_which_an_alternative_evaluates_fewer_effects() -> None:
    """With corners of any shape the samples no longer determine all: rounds of other columns do not agree."""
    few = {"row": "few samples", "replicate": 5}
    seed = np.random.SeedSequence(754595474468523945759359)
    assert loop_ordinary.run(loop_ordinary.EXPERIMENT.config, few, seed)["covered"] == 1.0


def test_a_law_that_does_not_converge_is_as_probable_as_along_its_own_motion() -> None:
    """Behind a low pass a bent sensor and a force that fluctuates were probable only far from the motion."""
    system = fb.Oscillator(mass=10.0, stiffness=1000.0)
    hertz = system.natural_frequency / (2.0 * math.pi)
    motion = fb.simulate(
        system,
        friction=1.0,
        initial_displacement=0.0205,
        duration=4.75 / hertz,
        sampling_rate=1000.0 * hertz,
        noise_sd=0.02 / 60.0,
        seed=1,
    )
    sections = signal.butter(3, 15.0 * hertz, fs=1000.0 * hertz, output="sos")
    settled = signal.sosfilt_zi(sections) * motion.values[0]
    values, _ = signal.sosfilt(sections, motion.values, zi=settled)
    report = fb.close_loop(fb.make_record(motion["time"].values, values, "displacement"), system)
    assert report.verdict == "adequate"
    assert report.friction_after["mean"] == pytest.approx(1.0, abs=0.01)
