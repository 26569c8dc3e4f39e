"""What a sampler sees of several records: their very likelihood, own coefficients integrated out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from decays import SYSTEM, slow_decay
from dense_force import dense_covariance
from friction_bayes.loop.checks.joint_target import JointTarget
from friction_bayes.loop.checks.sampler_check import check_law
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.law_fit import LawFit, fit_law

EFFECTS = ("viscous_damping", "random_force", "sensor_offset")


@pytest.fixture(scope="module")
def fit() -> LawFit:
    """Two short releases, friction of the second a little larger; one sensor is twice as noisy."""
    records = [
        slow_decay(
            friction=friction,
            duration=4.0,
            sampling_rate=30.0,
            noise_sd=noise,
            seed=k,
            effects={"random_force.sd": 0.005, "random_force.correlation_time": 0.1},
        )
        for k, (friction, noise) in enumerate([(0.07, 1e-4), (0.073, 2e-4)])
    ]
    return fit_law(cut_records(records, SYSTEM), SYSTEM, EFFECTS, varying=False, noise="auto")


def of_set(fit: LawFit, *, varies: bool, forced: bool) -> JointTarget:
    """The most probable set with one friction or one of each record, under a random force or none."""
    weight = fit.posterior.weight[(fit.posterior.ratio > 0.0) == forced].sum(axis=0)
    row = int(np.argmax(np.where((fit.spread_of > 0.0) == varies, weight, -1.0)))
    return JointTarget(problem=fit.problem, posterior=fit.posterior, row=row, prior=fit.prior, forced=forced)


def densely(target: JointTarget, theta: np.ndarray, r: int) -> float:
    """Log density of a record by the covariance of all its samples."""
    problem, row = target.problem, target.row
    member, s = problem.members[r], target.shared.size
    regression = member.regression
    variance = math.exp(theta[s])
    covariance = variance * member.noise**2 * np.diag(regression.clock.variance)
    if target.forced:
        phase = regression.clock.phase
        stiffness, beside = np.ones(phase.size - 1), regression.clock.beside
        states = dense_covariance(phase, stiffness, math.exp(theta[s + 2]), beside)
        shows = np.kron(np.eye(phase.size), regression.row)
        covariance += (member.force * math.exp(theta[s + 1])) ** 2 * shows @ states @ shows.T
    own = problem.inside(row)
    columns = regression.columns * problem.scale
    covariance += columns[:, own] @ columns[:, own].T
    column, sd = problem.deviation(row)
    if column >= 0:
        covariance += sd**2 * np.outer(columns[:, column], columns[:, column])
    rest = regression.target - regression.columns[:, target.shared] @ theta[:s]
    return float(multivariate_normal.logpdf(rest, np.zeros(rest.size), covariance, allow_singular=True))


@pytest.mark.parametrize("forced", [True, False])
@pytest.mark.parametrize("varies", [False, True], ids=["one friction", "friction of each"])
def test_each_record_has_the_density_of_its_covariance(
    fit: LawFit, varies: bool, forced: bool, rng: np.random.Generator
) -> None:
    joint = of_set(fit, varies=varies, forced=forced)
    target = sampled(fit, joint)
    theta = rng.multivariate_normal(target.centre, target.covariance, 12)
    theta = theta[np.isfinite(target.log_prob(theta))][:4]
    assert len(theta) == 4
    found = joint.each_record(theta)
    expected = np.array([[densely(joint, one, r) for r in range(2)] for one in theta])
    # dry friction is cut out of a start that is of the size of its prior: six digits of that are left
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5e-3)
    together = target.log_prob(theta) - target.log_prior(theta)
    np.testing.assert_allclose(together, found.sum(axis=1), rtol=1e-12)


def sampled(fit: LawFit, joint: JointTarget):  # type: ignore[no-untyped-def]
    dry = fit.law.dry_friction
    signals = [one.segment.values[: one.samples] for one in fit.fits]
    return joint.target(
        natural=lambda laws: {"friction": laws[:, dry]}, signals=signals, unit=fit.fits[0].unit
    )


@pytest.mark.parametrize("forced", [True, False])
def test_the_closed_form_differs_by_nearly_a_constant(
    fit: LawFit, forced: bool, rng: np.random.Generator
) -> None:
    """But for the closed form's prior precision, which is in units of the noise found with all columns."""
    target = sampled(fit, of_set(fit, varies=True, forced=forced))
    theta = rng.multivariate_normal(target.centre, target.covariance, 40)
    log_prob = target.log_prob(theta)
    inside = np.isfinite(log_prob)
    assert inside.sum() > 20
    difference = log_prob[inside] - target.closed_form(theta[inside])
    assert np.std(log_prob[inside]) > 1.0
    assert np.std(difference) < 0.25 * np.std(log_prob[inside])
    negative = np.where(np.arange(theta.shape[1]) == 1, -1.0, theta[inside][0])
    assert target.closed_form(negative[None])[0] == -math.inf
    assert target.log_prob(negative[None])[0] == -math.inf


def test_replicates_scatter_as_the_records_do(fit: LawFit, rng: np.random.Generator) -> None:
    joint = of_set(fit, varies=True, forced=True)
    target = sampled(fit, joint)
    drawn = target.predictive(np.tile(target.centre, (60, 1)), rng)
    assert drawn.shape[1] == target.observed.size
    # posterior predictive about the record: its noise and what is drawn of its own
    away = drawn - target.observed
    assert np.all(np.abs(away.mean(axis=0)) < 5e-4)
    assert 1e-4 < away.std() < 2e-3


@pytest.mark.parametrize("forced", [True, False])
def test_closed_form_and_sampler_agree(fit: LawFit, forced: bool) -> None:
    every = np.ones(fit.posterior.weight.shape, np.bool_)
    check, _ = check_law(fit, every, 1.0, "N", 1, forced=forced)
    assert check["converged"]
    assert 0.0 < check["share"] <= 1.0
    # a short record leaves the closed form its short cuts: a tenth of its sd
    sampled, closed = check["friction"], check["closed_form"]
    assert sampled["mean"] == pytest.approx(closed["mean"], abs=0.1 * closed["sd"])
    assert sampled["sd"] == pytest.approx(closed["sd"], rel=0.1)
