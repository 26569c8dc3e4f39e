"""What is drawn of a record is the law that was found."""

from __future__ import annotations

import numpy as np

from friction_bayes.loop.infer.coulomb_fit import fit_coulomb
from friction_bayes.loop.infer.law_draws import draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.report.motion_trace import motion_trace
from unsteady_decays import SYSTEM, fitted, sensed, unsteady_motion


def test_turning_points_of_a_law_without_a_force_do_not_fluctuate(rng: np.random.Generator) -> None:
    """The path that a law is evaluated along was smoothed with a force in addition to it."""
    motion = unsteady_motion(rng)[0]
    fit = fitted(
        sensed(motion + 2e-5 * rng.standard_normal(motion.size)), ("viscous_damping", "random_force")
    )
    plain = np.array([not names for names in fit.sets]) & fit.regression.sets[:, fit.law.dry_friction]
    (alone,) = LawFit.of(fit).among((fit.posterior.ratio == 0.0)[:, None] & plain).fits
    before = fit_coulomb(SYSTEM, (fit.segment,))
    draws = draw_laws(LawFit.of(alone), rng, 100).first
    trace = motion_trace(alone, before, 0, draws, factor=1.0, fluctuates=False)
    lost = -np.diff(np.abs(trace.turning_points))
    assert np.std(lost) < 0.02 * np.mean(lost)
    assert np.std(np.diff(np.abs(fit.path.turning_x))) > 0.05 * np.mean(lost)
