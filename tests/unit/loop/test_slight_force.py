"""A random force that a record may hide widens friction where no force is in the law."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.mixture.slight_effects import SlightForce, slight_force
from unsteady_decays import FRICTION, SYSTEM, faulty_record, fitted

EFFECTS = ("random_force", "sensor_offset")


def test_noise_hides_more_than_it_makes_of_friction(rng: np.random.Generator) -> None:
    fit = fitted(faulty_record(rng, force=0.0, noise=3e-4)[0], EFFECTS)
    hidden = slight_force(LawFit.of(fit))
    assert hidden is not None
    assert 0.1 < hidden.probability < 0.9
    none = next(point for point in fit.posterior.points if point.ratio == 0.0)
    best, j = int(np.argmax(none.found.log_weight)), fit.law.frictions[0]
    _, scale2 = fit.posterior.problem.marginals(none, best)
    own = float(np.sqrt(scale2[j])) * fit.regression.scale[j] * fit.law.unit_force
    # the less a law is off by noise, the more a force of the size that this noise hides moves it
    assert own < hidden.sd < 0.2 * SYSTEM.stiffness * FRICTION


def test_a_force_that_shows_hides_nothing(rng: np.random.Generator) -> None:
    fit = fitted(faulty_record(rng, force=0.5, noise=2e-5)[0], EFFECTS)
    hidden = slight_force(LawFit.of(fit))
    best = fit.posterior.best
    shown = best.ratio * best.noise * fit.law.unit_force
    # at most a force far smaller than the one that is there
    assert hidden is None or hidden.sd < 0.01 * shown


def test_no_random_force_leaves_friction_to_the_noise(rng: np.random.Generator) -> None:
    record = faulty_record(rng, force=0.0, noise=3e-4)[0]
    wide, narrow = (
        np.ptp(
            fb.close_loop([record], SYSTEM, seed=1, effects=EFFECTS, random_force=choice).friction_after[
                "interval90"
            ]
        )
        for choice in ("auto", "none")
    )
    assert wide > 1.1 * narrow


def test_draws_that_would_be_negative_stay(rng: np.random.Generator) -> None:
    moved = SlightForce(1.0, 0.0, 10.0).added_to(np.full(1000, 0.1), rng)
    assert np.all(moved >= 0.0)
    assert np.mean(moved == 0.1) == pytest.approx(0.5, abs=0.1)
    np.testing.assert_array_equal(SlightForce(0.0, 1.0, 1.0).added_to(moved, rng), moved)
