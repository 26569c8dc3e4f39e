"""The sampler's posterior under a random force: against a dense normal, and next to the closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from dense_force import dense_covariance
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint, at_resonance
from friction_bayes.statespace.kalman import Clock, CorrelatedError, sensor_row, whiten
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.sampling.law_target import half_cycle_blocks, law_target
from friction_bayes.statespace.sampling.replication import drawn_fluctuation, drawn_noise
from friction_bayes.statespace.smoother import SmoothedMotion
from friction_bayes.statespace.transition import initial_response

ORDERS = (0, 1, 2)
NOISE, FORCE, TAU, FRICTION = 1.0, 2.0, 0.6, 3.0
TOLERANCE = 0.01
"""Nats: what interpolation between the points of the grid may change."""


def problem(order: int, rng: np.random.Generator, samples: int = 250, positive: bool = False):
    """A record of unit noise under a force, on the columns of a plain law along a known motion."""
    phase = np.arange(samples) * 0.25
    row = sensor_row(order)
    amplitude = 400.0 - 2.0 * FRICTION / math.pi * phase
    x, v = amplitude * np.cos(phase), -amplitude * np.sin(phase)
    path = MeasuredPath.through(phase, x, v)
    forces = np.stack([-path.direction, -path.node_x], axis=1)
    states = force_response(path, forces)
    answered = at_sensor(states, row, np.stack([-path.expected_direction, -path.x], axis=1))
    start = initial_response(phase)
    columns = np.column_stack([at_sensor(start, row), answered, np.ones(samples)])
    law = np.array([400.0, 0.0, FRICTION, 0.001, 2.0])
    clock = Clock.of(phase)
    force = FORCE * drawn_fluctuation(clock, TAU, rng) @ row
    signal = columns @ law + force + NOISE * rng.standard_normal(samples)
    motion = SmoothedMotion(
        states=np.column_stack([x, v, np.zeros(samples)]),
        covariance=np.zeros((samples, 3, 3)),
        noise=NOISE,
        force_sd=FORCE,
        tau=TAU,
    )
    regression = LawRegression(
        clock=clock,
        row=row,
        names=("displacement", "velocity", "friction", "stiffness", "rest"),
        columns=columns,
        states=np.concatenate([start, states, np.zeros((samples, 2, 1))], axis=2),
        known_states=np.zeros((samples, 2)),
        target=signal,
        scale=np.array([4e3, 4e3, 6.0, 0.05, 40.0]),
        positive=np.arange(5) == 2 if positive else np.zeros(5, np.bool_),
        sets=np.ones((1, 5), np.bool_),
        log_prior=np.zeros(1),
        stiffness=3,
        motion=motion,
    )
    return regression, ForcePrior(centre=0.3 * FRICTION)


def target_of(regression: LawRegression, prior: ForcePrior) -> Target:
    return law_target(
        Problem.of(regression),
        prior,
        natural=lambda law, noise, q, tau: {"friction": law[:, 2], "force": q, "tau": tau, "noise": noise},
        signals=[regression.target],
        unit=1.0,
    )


def points(target: Target, rng: np.random.Generator, count: int) -> np.ndarray:
    """Points as wide as an ensemble starts, where the posterior is not zero."""
    root = np.linalg.cholesky(target.covariance)
    theta = target.centre + 2.0 * rng.standard_normal((count, len(target.names))) @ root.T
    return theta[np.isfinite(target.log_prob(theta))]


@pytest.mark.parametrize("order", ORDERS)
def test_likelihood_is_that_of_a_dense_normal(order, rng) -> None:
    regression, prior = problem(order, rng, samples=80)
    target = target_of(regression, prior)
    theta = points(target, rng, 12)
    assert len(theta) >= 6
    read = np.kron(np.eye(80), regression.row)
    for row in theta:
        states = dense_covariance(
            regression.clock.phase, np.ones(regression.clock.phase.size - 1), math.exp(row[-1])
        )
        covariance = math.exp(2.0 * row[-2]) * read @ states @ read.T + math.exp(row[-3]) * np.eye(80)
        dense = multivariate_normal(regression.columns @ row[:-3], covariance).logpdf(regression.target)
        likelihood = target.log_prob(row[None])[0] - target.log_prior(row[None])[0]
        assert likelihood == pytest.approx(dense, abs=TOLERANCE)
        assert target.pointwise(row[None]).sum() == pytest.approx(dense, abs=1e-6)


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_closed_form_and_sampler_differ_by_one_constant(order, positive, rng) -> None:
    """But for two priors that the closed form takes at the noise found: these are put right here, by hand.

    They are that of the coefficients, in units of the noise with all columns, and that of the force's size.
    """
    regression, prior = problem(order, rng, positive=positive)
    target, scale = target_of(regression, prior), regression.scale
    theta = points(target, rng, 60)
    assert len(theta) > 25
    honest, at_noise_found = np.empty(len(theta)), np.empty(len(theta))
    for i, row in enumerate(theta):
        ratio, tau = math.exp(row[-2] - 0.5 * row[-3]), math.exp(row[-1])
        found = Problem.of(regression).evaluate(ratio, tau)
        # as the closed form has it where coefficients need not be positive
        whitened = regression.whiten_at(ratio, tau)
        away = np.linalg.solve(
            whitened.gram[:-1, :-1] + found.full_noise2 * np.eye(5),
            whitened.gram[:-1, -1] - found.full_noise2 * regression.reference,
        )
        mean = regression.reference + away
        rest = np.append(-away, 1.0)
        noise2 = (rest @ whitened.gram @ rest + found.full_noise2 * mean @ mean) / 250
        share = found.full_noise2 / math.exp(row[-3])
        square = float(np.sum((row[:5] / scale) ** 2))
        honest[i] = -0.5 * square + prior.log_density(math.exp(row[-2]), tau)
        at_noise_found[i] = -0.5 * share * square + 2.5 * math.log(share)
        at_noise_found[i] += prior.log_density(ratio * math.sqrt(noise2), tau)
    difference = target.log_prob(theta) - target.closed_form(theta)
    assert np.ptp(difference - honest + at_noise_found) < TOLERANCE
    # a lost Jacobian would show: log_force_sd is not log q / sigma
    assert np.ptp(difference - honest + at_noise_found - 0.5 * theta[:, -3]) > 0.1


@pytest.mark.parametrize("least_noise", [0.0, 1.3 * NOISE], ids=["any noise", "noise at its least"])
def test_centre_and_covariance_are_those_of_a_fine_grid(least_noise: float, rng) -> None:
    """The grid's own moments against a weighted sum over another grid, in other coordinates."""
    regression, prior = problem(0, rng)
    regression = replace(regression, least_noise=least_noise)
    target = target_of(regression, prior)
    low, high = math.log(prior.tau_low), math.log(prior.tau_high)
    weight, mean, variance, log_tau = [], [], [], []
    for ratio in np.exp(np.linspace(-1.5, 3.0, 40)):
        for tau in np.exp(np.linspace(low + 1e-9, high - 1e-9, 27)):
            found = Problem.of(regression).evaluate(ratio, tau)
            weight.append(found.log_weight[0] + prior.log_density(ratio * math.sqrt(found.noise2[0]), tau))
            point = GridPoint(ratio=ratio, tau=tau, log_volume=0.0, found=found)
            location, scale2 = Problem.of(regression).marginals(point, 0)
            mean.append(location[2] * 6.0)
            variance.append(scale2[2] * 36.0)
            log_tau.append(math.log(tau))
    share = np.exp(np.array(weight) - max(weight))
    share /= share.sum()
    average = share @ mean
    sd = math.sqrt(share @ (np.array(variance) + (np.array(mean) - average) ** 2))
    assert target.centre[2] == pytest.approx(average, abs=0.02 * sd)
    assert math.sqrt(target.covariance[2, 2]) == pytest.approx(sd, rel=0.02)
    time = share @ log_tau
    spread = math.sqrt(share @ (np.array(log_tau) - time) ** 2)
    assert target.centre[-1] == pytest.approx(time, abs=0.1 * spread)
    assert target.humps == ()


def test_nothing_outside_the_support(rng) -> None:
    regression, prior = problem(0, rng, positive=True)
    target = target_of(regression, prior)
    assert np.isfinite(target.log_prob(target.centre[None])).all()
    for change in ({2: -0.1}, {-1: math.log(prior.tau_high) + 1e-6}, {-1: math.log(prior.tau_low) - 1e-6}):
        theta = target.centre.copy()
        for index, value in change.items():
            theta[index] = value
        assert target.log_prob(theta[None])[0] == -math.inf
        assert target.closed_form(theta[None])[0] == -math.inf
    with pytest.raises(InputError, match="improper"):
        target.prior_draws(rng, 3)


def test_prior_of_the_force_broadcasts() -> None:
    prior = ForcePrior(centre=2.0)
    q, tau = np.array([0.5, 2.0, 9.0]), np.array([0.01, 1.0, 5.0])
    together = prior.log_density(q, tau)
    assert together[0] == -math.inf
    assert together[1:].tolist() == [prior.log_density(2.0, 1.0), prior.log_density(9.0, 5.0)]
    assert ForcePrior(centre=2.0, none=1.0).log_density(2.0, 1.0) == -math.inf
    log_q, log_tau = (
        np.linspace(*ends, 400) for ends in ((-6.0, 8.0), np.log([prior.tau_low, prior.tau_high]))
    )
    density = np.exp(prior.log_density(np.exp(log_q)[:, None], np.exp(np.clip(log_tau, -2.76, 2.93))))
    assert np.trapezoid(np.trapezoid(density, log_tau), log_q) == pytest.approx(1.0 - prior.none, rel=0.01)
    assert at_resonance(1.0) == 1.0


@pytest.mark.parametrize("tau", [0.1, 3.0])
def test_drawn_fluctuations_have_the_dense_covariance(tau, rng) -> None:
    phase = np.cumsum(rng.uniform(0.05, 0.4, 12))
    draws = np.array([drawn_fluctuation(Clock.of(phase), tau, rng).ravel() for _ in range(10_000)])
    dense = dense_covariance(phase, np.ones(phase.size - 1), tau)
    sd = np.sqrt(np.diag(dense) + 1e-12)
    # five errors of a correlation, one over the root of the number of draws: passed once in 2,000 runs
    np.testing.assert_allclose(np.cov(draws.T) / np.outer(sd, sd), dense / np.outer(sd, sd), atol=0.05)


def test_drawn_noise_has_the_variances_and_the_error_of_the_clock(rng) -> None:
    phase, variance = np.cumsum(rng.uniform(0.05, 0.4, 12)), rng.uniform(0.5, 2.0, 12)
    error = CorrelatedError(1.5, 0.3)
    clock = replace(Clock.of(phase, variance), error=error)
    draws = np.array([drawn_noise(clock, rng) for _ in range(20_000)])
    apart = np.abs(np.subtract.outer(phase, phase))
    expected = np.diag(variance) + error.ratio**2 * np.exp(-apart / error.tau)
    # errors of covariances: the variances, up to 4.25, times the root of two over the number of draws
    np.testing.assert_allclose(np.cov(draws.T), expected, atol=0.2)


def test_replications_scatter_as_the_model_says(rng) -> None:
    regression, prior = problem(0, rng)
    target = target_of(regression, prior)
    theta = np.tile(target.centre, (400, 1))
    drawn = target.predictive(theta, rng)
    assert drawn.shape == (400, 250)
    law = target.centre[:5]
    ratio = math.exp(target.centre[-2] - 0.5 * target.centre[-3])
    whitened = whiten(
        (drawn - regression.columns @ law).T,
        regression.clock,
        regression.row,
        ratio,
        math.exp(target.centre[-1]),
        keep=True,
    )
    assert np.std(whitened.columns) == pytest.approx(math.exp(0.5 * target.centre[-3]), rel=0.02)


def test_half_cycle_blocks() -> None:
    assert half_cycle_blocks(5.0 + np.arange(100) * 0.1).tolist() == [0, 32, 63]
    assert half_cycle_blocks(np.array([0.0, 0.5])).tolist() == [0]
