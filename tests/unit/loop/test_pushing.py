"""Friction that would push is no candidate."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM
from friction_bayes.loop.random_force.fit import fit_random_force
from friction_bayes.loop.random_force.pushing import pushing
from friction_bayes.loop.segment import cut_records

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
    assert "position_friction" in fit.sets.effects[fit.chosen]
    found = pushing(fit)
    assert found[fit.chosen] == pushes
    # what has no friction, or friction of one kind alone, cannot push
    alone = np.array([not names & {"position_friction", "asymmetric_friction"} for names in fit.sets.effects])
    assert not found[alone].any()
