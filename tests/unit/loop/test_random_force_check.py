"""The check of a law under a random force: emcee on the closed form's columns, confined to their support."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from fluctuating_force import fluctuating_decay
from friction_bayes.loop.checks.sampler_check import check_law, target_of_set
from friction_bayes.loop.infer.law_fit import LawFit
from unsteady_decays import fitted

SYSTEM = fb.Oscillator(mass=2.0, stiffness=200.0)
STEP = 0.02
EFFECTS = ("viscous_damping", "quadratic_drag", "random_force", "sensor_offset")


@pytest.fixture(scope="module")
def fit() -> LawFit:
    rng = np.random.default_rng(1)
    values = fluctuating_decay(
        rng,
        frequency=10.0,
        friction=0.001,
        release=0.1,
        step=STEP,
        samples=1100,
        force_sd=3e-4,
        correlation_time=0.1,
    )[0]
    noisy = values + 3e-4 * rng.standard_normal(values.size)
    record = fb.make_record(STEP * np.arange(values.size), noisy, "displacement")
    return LawFit.of(fitted(record, EFFECTS, SYSTEM))


def best_set(fit: LawFit, *, forced: bool) -> int:
    weight = fit.posterior.weight[(fit.posterior.ratio > 0.0) == forced]
    return int(weight.sum(axis=0).argmax())


def every_cell(fit: LawFit) -> np.ndarray:
    return np.ones(fit.posterior.weight.shape, np.bool_)


def test_coefficients_stay_in_their_support(fit: LawFit) -> None:
    chosen = fit.sets.index(frozenset({"viscous_damping"}))
    target = target_of_set(fit, chosen, forced=True)
    # the zero within a step is integrated out
    assert len(target.names) == fit.fits[0].regression.sets[chosen].sum() + 2
    assert np.isfinite(target.log_prob(target.centre[None])).all()
    positive = np.flatnonzero(fit.problem.positive[fit.fits[0].regression.sets[chosen]])
    assert positive.size == 2
    for j in positive:
        theta = target.centre.copy()
        theta[j] *= -1.0
        assert target.log_prob(theta[None])[0] == -math.inf


def test_closed_form_and_sampler_agree_on_friction(fit: LawFit) -> None:
    assert fit.sets[best_set(fit, forced=True)] == frozenset()
    check, _ = check_law(fit, every_cell(fit), 1.0, "N", seed=1, forced=True)
    assert check["converged"]
    assert check["rhat"] < 1.01
    assert check["agrees"] is True, check["because"]
    assert check["friction"]["unit"] == "N"
    assert check["friction"]["mean"] == pytest.approx(0.2, abs=4.0 * check["friction"]["sd"])


def test_a_positive_coefficient_near_zero(fit: LawFit, monkeypatch: pytest.MonkeyPatch) -> None:
    """Viscous damping that is not there: friction together with it is far from normal."""
    # over a thousand effective draws of friction: a fortieth of its sd
    monkeypatch.setattr("friction_bayes.loop.checks.sampler_check._MOST_STEPS", 1500)
    viscous = fit.sets.index(frozenset({"viscous_damping"}))
    alone = np.zeros(fit.posterior.weight.shape, np.bool_)
    alone[:, viscous] = True
    check, _ = check_law(fit, alone, 1.0, "N", seed=1, forced=True)
    sampled, closed = check["friction"], check["closed_form"]
    assert sampled["mean"] == pytest.approx(closed["mean"], abs=0.12 * closed["sd"])
    assert sampled["sd"] == pytest.approx(closed["sd"], rel=0.08)
    # the size and the correlation time of the force mix slowly here, and the check says so by itself
    assert check["converged"] or "not converged" in check["because"]


def test_closed_form_and_sampler_agree_without_a_force(fit: LawFit) -> None:
    check, _ = check_law(fit, every_cell(fit), 1.0, "N", seed=1, forced=False)
    assert check["converged"]
    assert check["agrees"] is True, check["because"]


def test_the_target_without_a_force_is_the_closed_form(fit: LawFit) -> None:
    """They differ in the unit of the prior precision alone: the noise found, or the noise itself."""
    chosen = best_set(fit, forced=False)
    target = target_of_set(fit, chosen, forced=False)
    rng = np.random.default_rng(1)
    theta = target.centre + 0.3 * rng.standard_normal((50, target.centre.size)) * np.sqrt(
        np.diag(target.covariance)
    )
    step = np.array([column.kind == "step" for column in fit.law.columns])
    scaled = theta[:, :-1] / fit.problem.scale[fit.fits[0].regression.sets[chosen] & ~step]
    # the noise found with all columns of the set
    log_v = theta[:, -1] - math.log(fit.problem.only(chosen, step).evaluate(0.0, 1.0).full_noise2)
    prior = 0.5 * (scaled.shape[1] * log_v + (scaled**2).sum(axis=1) * np.expm1(-log_v))
    difference = target.log_prob(theta) - target.closed_form(theta) - prior
    inside = np.isfinite(difference)
    assert inside.sum() > 20
    assert np.ptp(difference[inside]) < 1e-6
    blocks = target.pointwise(theta).sum(axis=1)
    # of the zero within a step, which is integrated out, the blocks are given one draw
    np.testing.assert_allclose(blocks + target.log_prior(theta), target.log_prob(theta), atol=0.5)
