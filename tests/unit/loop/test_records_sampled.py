"""What a sampler sees of several records: their very likelihood, own coefficients integrated out."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from decays import SYSTEM, slow_decay
from dense_force import dense_covariance
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.loop.checks.sampler_check import check_law, target_of_set
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.infer.law_fit import LawFit, fit_law
from loop_options import loop_options

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
    return fit_law(cut_records(records, SYSTEM), SYSTEM, loop_options(EFFECTS))


def of_set(fit: LawFit, *, varies: bool, forced: bool) -> int:
    """The most probable set with one friction or one of each record, under a random force or none."""
    weight = fit.posterior.weight[(fit.posterior.ratio > 0.0) == forced].sum(axis=0)
    return int(np.argmax(np.where((fit.spread_of > 0.0) == varies, weight, -1.0)))


Targets = Callable[[bool, bool], Target]


@pytest.fixture(scope="module")
def target_of(fit: LawFit) -> Targets:
    """Target of that set, built once for all tests: it takes a second."""
    return cache(
        lambda varies, forced: target_of_set(fit, of_set(fit, varies=varies, forced=forced), forced=forced)
    )


def densely(fit: LawFit, row: int, theta: np.ndarray, r: int, *, forced: bool) -> float:
    """Log density of a record by the covariance of all its samples, its own coefficients among them."""
    problem = fit.problem.only(row)
    member, s = problem.members[r], problem.shared.size
    regression, variance = member.regression, math.exp(theta[s])
    covariance = variance * member.noise**2 * np.diag(regression.clock.variance)
    ratio, tau = 0.0, 1.0
    if forced:
        phase = regression.clock.phase
        ratio, tau = math.exp(theta[s + 1]) / math.sqrt(variance), math.exp(theta[s + 2])
        stiffness, added = np.ones(phase.size - 1), np.tile(np.eye(2), (phase.size - 1, 1, 1))
        added[regression.clock.acts] = regression.clock.feedback
        states = dense_covariance(phase, stiffness, tau, added)
        shows = np.kron(np.eye(phase.size), regression.row)
        covariance += (member.force * math.exp(theta[s + 1])) ** 2 * shows @ states @ shows.T
    # their prior is in units of the noise
    scale2 = variance / problem.evaluate(ratio, tau).full_noise2
    columns = regression.columns * problem.scale
    covariance += scale2 * columns[:, problem.own] @ columns[:, problem.own].T
    column, sd = problem.deviation(0)
    if column >= 0:
        covariance += scale2 * sd**2 * np.outer(columns[:, column], columns[:, column])
    rest = regression.target - regression.columns[:, problem.shared] @ theta[:s]
    return float(multivariate_normal.logpdf(rest, np.zeros(rest.size), covariance, allow_singular=True))


@pytest.mark.parametrize("forced", [True, False])
@pytest.mark.parametrize("varies", [False, True], ids=["one friction", "friction of each"])
def test_the_records_have_the_density_of_their_covariances(
    fit: LawFit, target_of: Targets, varies: bool, forced: bool, rng: np.random.Generator
) -> None:
    row, target = of_set(fit, varies=varies, forced=forced), target_of(varies, forced)
    theta = rng.multivariate_normal(target.centre, target.covariance, 12)
    theta = theta[np.isfinite(target.log_prob(theta))][:4]
    assert len(theta) == 4
    found = target.log_prob(theta) - target.log_prior(theta)
    expected = np.array([sum(densely(fit, row, one, r, forced=forced) for r in range(2)) for one in theta])
    # dry friction is cut out of a start that is of the size of its prior: six digits of that are left
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-2)


def test_half_cycles_have_a_density_each_given_a_record_s_own_coefficients(
    fit: LawFit, target_of: Targets, rng: np.random.Generator
) -> None:
    target = target_of(True, True)
    theta = rng.multivariate_normal(target.centre, target.covariance, 60)
    theta = theta[np.isfinite(target.log_prob(theta))][:30]
    each = target.pointwise(theta)
    turns = sum(one.path.turning.size for one in fit.fits)
    assert turns - 4 <= each.shape[1] <= turns + 4
    # integrated over them the density is less than where they are likely, by half a nat and more for each
    integrated = target.log_prob(theta) - target.log_prior(theta)
    assert np.all(each.sum(axis=1) > integrated)


@pytest.mark.parametrize("forced", [True, False])
def test_the_closed_form_differs_by_nearly_a_constant(
    target_of: Targets, forced: bool, rng: np.random.Generator
) -> None:
    """But for the closed form's prior precision, which is in units of the noise found with all columns."""
    target = target_of(True, forced)
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


def test_replicates_scatter_as_the_records_do(target_of: Targets, rng: np.random.Generator) -> None:
    target = target_of(True, True)
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
