"""Friction that would push is no candidate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, slow_decay
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.record_fit import fit_random_force
from friction_bayes.loop.mixture.record_candidates import candidates_of_record
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
    assert not fit.pushes[fit.chosen]
    assert ("position_friction" in fit.sets.effects[fit.chosen]) != pushes
    # what has no friction, or friction of one kind alone, cannot push
    alone = np.array([not names & {"position_friction", "asymmetric_friction"} for names in fit.sets.effects])
    assert not fit.pushes[alone].any()


def test_the_best_law_is_none_that_is_left_out() -> None:
    """Another set of columns of the same effects may push, and be the more probable one."""
    fluctuating = fluctuating_friction(0.3)
    record = slow_decay(duration=10.0, sampling_rate=50.0, noise_sd=1e-5, seed=3, effects=fluctuating)
    names = ("viscous_damping", "random_force")
    segments = cut_records([record], SYSTEM)
    found = candidates_of_record(segments[0], SYSTEM, loop_options(names), np.random.default_rng(2))
    effects, likely = found.fit.sets.effects, found.fit.among(found.cells.total > 0.0).chosen
    same = np.array([each == effects[likely] for each in effects])
    same[likely] = False
    assert same.any()
    # that one is left out, and the others of the same effects count
    found.cells = replace(found.cells, weight=np.where(same, 1.0, 0.0 * found.cells.weight))
    assert same[found.best[0].chosen]
