"""Jumps of a random force: their tails, and the intervals in which they are let off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import friction_bayes as fb
from friction_bayes.loop.infer.knocks import jump_tails, log_odds_of_knocks, spans_of
from friction_bayes.loop.report.motion_trace import knock_notes, knock_times
from friction_bayes.plotting.fluctuation import plot_fluctuation
from unsteady_decays import FRICTION, SYSTEM, WHITE, fitted, sensed, unsteady_motion


def test_spans_are_runs_of_intervals() -> None:
    jumps = np.array([2.0, 2.0, 0.0, 0.0, 3.0, 0.0, 1.0])
    assert spans_of(jumps) == [(0, 2), (4, 5), (6, 7)]
    assert spans_of(np.zeros(5)) == []


def test_each_knock_costs_the_odds_of_its_place() -> None:
    jumps = np.zeros(50)
    assert log_odds_of_knocks(jumps) == 0.0
    jumps[[3, 4, 20]] = 1.0
    assert log_odds_of_knocks(jumps) == pytest.approx(-2.0 * np.log(50.0))


def test_a_normal_force_has_normal_jumps_and_one_that_is_kicked_has_not(rng: np.random.Generator) -> None:
    ps = []
    for kicks in (False, True):
        motion = unsteady_motion(rng, 0.3, knock=_kicks(rng) if kicks else lambda t: 0.0)[0]
        fit = fitted(sensed(motion + WHITE * rng.standard_normal(motion.size)), ["sensor_offset"])
        assert not knock_times(fit)
        kurtosis, independent, p = jump_tails(fit.regression, fit.coefficients, fit.posterior.best)
        assert 20 < independent < fit.record.samples
        # of as many independent normal numbers, by simulation
        drawn = stats.kurtosis(rng.standard_normal((4000, int(independent))), axis=1, fisher=False)
        assert p == pytest.approx(np.mean(drawn >= kurtosis), abs=0.03)
        ps.append(p)
    assert ps[0] > 0.01
    assert ps[1] < 1e-4


def _kicks(rng: np.random.Generator):
    """A force that changes its sign now and then: a support that slips."""
    times = np.cumsum(rng.uniform(0.8, 1.6, 20))
    return lambda t: 1.5 * (-1.0) ** int(np.searchsorted(times, t))


def test_a_knock_is_reported_in_the_report() -> None:
    rng = np.random.default_rng(3)
    motion = unsteady_motion(rng, 0.2, knock=lambda t: 6.0 * (4.0 <= t < 4.05))[0]
    record = sensed(motion + WHITE * rng.standard_normal(motion.size))
    report = fb.close_loop([record], SYSTEM, effects=["random_force", "viscous_damping"], seed=1)
    reported = [note for note in report.notes if "knocked at" in note]
    assert len(reported) == 1
    assert _size(reported[0]) == pytest.approx(6.0 * FRICTION * SYSTEM.stiffness, rel=0.2)
    low, high = report.friction_after["interval90"]
    assert low < FRICTION * SYSTEM.stiffness < high
    trace = report.traces[0].fluctuation
    assert trace is not None
    ((start, end),) = trace.knocks
    assert start < 4.05
    assert end > 4.0


def _size(note: str) -> float:
    return float(note.split("changes by ")[1].split(" N")[0])


def test_a_constant_force_which_an_accelerometer_does_not_show_is_no_part_of_a_knock() -> None:
    rng = np.random.default_rng(3)
    motion = unsteady_motion(rng, 0.2, knock=lambda t: 6.0 * (4.0 <= t < 4.05))[2]
    fit = fitted(sensed(motion + 100.0 * WHITE * rng.standard_normal(motion.size), 2), ["viscous_damping"])
    sizes = []
    for level in (0.0, -8.0 * FRICTION):
        states = fit.motion.states + np.array([0.0, 0.0, level])
        there = replace(fit, motion=replace(fit.motion, states=states))
        (note,) = knock_notes(there, SYSTEM.stiffness, "N")
        sizes.append(_size(note))
    assert sizes[0] == pytest.approx(6.0 * FRICTION * SYSTEM.stiffness, rel=0.2)
    assert sizes[1] == sizes[0]


@pytest.fixture(scope="module")
def knocked_once() -> fb.LoopReport:
    """Of a motion without a random force."""
    rng = np.random.default_rng(4)
    motion = unsteady_motion(rng, 0.0, knock=lambda t: 6.0 * (4.0 <= t < 4.05))[0]
    record = sensed(motion + WHITE * rng.standard_normal(motion.size))
    return fb.close_loop([record], SYSTEM, effects=["random_force", "viscous_damping"], seed=1)


def test_a_knock_in_a_motion_without_a_random_force_is_no_random_force(knocked_once: fb.LoopReport) -> None:
    report = knocked_once
    assert any("knocked at" in note for note in report.notes)
    assert report.candidates[0]["effects"] == []
    named = [tuple(candidate["effects"]) for candidate in report.candidates]
    assert len(set(named)) == len(named)
    low, high = report.friction_after["interval90"]
    assert low < FRICTION * SYSTEM.stiffness < high


def test_a_knock_beside_no_random_force_is_drawn_alone(knocked_once: fb.LoopReport) -> None:
    trace = knocked_once.traces[0]
    assert trace.fluctuation is not None
    assert not trace.fluctuation.fluctuates
    assert len(plot_fluctuation(trace).axes) == 1
    # what is left may depend on the motion all the same, by less than matters
    assert len(plot_fluctuation(trace, "amplitude", "friction proportional to the amplitude").axes) == 1
