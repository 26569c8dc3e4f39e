"""Friction that would push is no candidate, and neither is a sensor that shows next to none of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.loop.columns.moving_record import MovingRecord
from friction_bayes.loop.data.parameters import scales_of
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.impossible import impossible, integrate_possible
from friction_bayes.loop.infer.law_along_motion import LawAlongMotion
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import fit_random_force
from friction_bayes.loop.mixture.candidates import candidates_of
from friction_bayes.loop.mixture.mixture import cells_of
from friction_bayes.statespace.force_grid import integrate_force
from loop_options import loop_options

RELEASE = 0.02


@pytest.mark.parametrize(("slope", "pushes"), [(0.5, False), (4.0, True)])
def test_friction_that_changes_sign_along_the_way_is_no_candidate(slope: float, pushes: bool) -> None:
    record = fb.simulate(
        SYSTEM,
        friction=0.05,
        initial_displacement=RELEASE,
        duration=8.0,
        sampling_rate=200.0,
        noise_sd=5e-6,
        effects={"viscous_damping.damping_ratio": 0.02, "position_friction.slope": slope / RELEASE},
        seed=5,
    )
    (segment,) = cut_records([record], SYSTEM)
    offered = ["viscous_damping", "position_friction", "asymmetric_friction"]
    fit = fit_random_force(segment, SYSTEM, offered)
    assert fit is not None
    # the motion goes along a law that resists
    assert not fit.impossible[fit.chosen]
    assert ("position_friction" in fit.sets[fit.chosen]) != pushes
    # what has no friction, or friction of one kind alone, cannot push
    alone = np.array([not names & {"position_friction", "asymmetric_friction"} for names in fit.sets])
    assert not fit.impossible[alone].any()


def test_a_fault_along_the_smoothed_signal_is_not_the_motion() -> None:
    """Along the signal an error of once a turn can be all of it: the law is left with what is small."""
    wheel = fb.Oscillator(inertia=0.0175, stiffness=0.265)
    record = fb.simulate(
        wheel,
        friction=2e-3,
        initial_displacement=0.7,
        duration=30.0,
        sampling_rate=40.0,
        quantity="angle",
        noise_sd=1e-4,
        effects={"random_force.sd": 0.02, "random_force.correlation_time": 0.1},
        seed=2,
    )
    (segment,) = cut_records([record], wheel)
    allowed = ("encoder_eccentricity",)
    whole = MovingRecord.of(segment, wheel, allowed, scales_of((segment,), wheel))
    w0, motion = whole.first_motion()
    found = LawAlongMotion.of(whole, motion, w0, ())
    assert found is not None

    def once_a_turn(law: Array) -> float:
        names = [column.parameter for column in found.law.columns]
        return sum(abs(size) for name, size in zip(names, law, strict=True) if name == "once_sine")

    free = integrate_force(found.problem, found.prior.without_force)
    assert once_a_turn(free.best_law()) > 0.5
    beyond = impossible(found, free)
    assert beyond[free.best.row]
    assert np.count_nonzero(beyond) > 1
    # what was not evaluated has no law of its own, and is not judged by another
    only = np.zeros_like(free.weight, np.bool_)
    only[:, free.best.row] = True
    assert np.flatnonzero(impossible(found, free.among(only))).tolist() == [free.best.row]
    bound = integrate_possible(found, found.prior.without_force)
    assert not impossible(found, bound)[bound.best.row]
    assert once_a_turn(bound.best_law()) < 0.2


def test_the_best_law_is_none_that_is_left_out() -> None:
    """Another set of columns of the same effects may push, and be the more probable one."""
    fluctuating = fluctuating_friction(0.3)
    record = slow_decay(duration=10.0, sampling_rate=50.0, noise_sd=1e-5, seed=3, effects=fluctuating)
    names = ("viscous_damping", "random_force")
    segments = cut_records([record], SYSTEM)
    found = candidates_of(segments[:1], SYSTEM, loop_options(names), np.random.default_rng(2))
    effects, likely = found.fit.sets, found.fit.among(found.cells.total > 0.0).fits[0].chosen
    same = np.array([each == effects[likely] for each in effects])
    same[likely] = False
    assert same.any()
    # that one is left out, and the others of the same effects count
    found.cells = replace(found.cells, weight=np.where(same, 1.0, 0.0 * found.cells.weight))
    assert same[found.best[0].chosen]


def test_a_record_that_no_law_explains_is_refused() -> None:
    """As one that leaps."""
    record = fb.simulate(
        SYSTEM,
        friction=0.05,
        initial_displacement=RELEASE,
        duration=8.0,
        sampling_rate=100.0,
        noise_sd=1e-5,
        seed=2,
    )
    (segment,) = cut_records([record], SYSTEM)
    fit = fit_random_force(segment, SYSTEM, ["sensor_offset"])
    assert fit is not None
    nothing = LawFit.of(replace(fit, impossible=np.ones(len(fit.sets), np.bool_)))
    with pytest.raises(InputError, match="no law whose friction resists the motion explains it"):
        cells_of(nothing)
