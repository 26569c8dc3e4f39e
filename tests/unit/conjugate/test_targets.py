"""The sampler's log-probability and the closed form differ by one constant, Jacobian included."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.conjugate.targets import (
    gamma_exponential_target,
    normal_gamma_target,
    regression_target,
)
from friction_bayes.core.errors import InputError

SAMPLES = np.array([0.09, 0.02, -0.03, 0.14, 0.11])
TIME = np.linspace(0.0, 1.0, 30)
DESIGN = np.column_stack([np.cos(9.0 * TIME), -TIME * np.cos(9.0 * TIME), np.ones(30)])
RESPONSE = DESIGN @ [1.0, 0.4, -0.2] + 0.1 * np.sin(37.0 * TIME)


def nig(precision: float, alpha: float, beta: float) -> Target:
    prior = NormalInverseGamma.from_prior(mean=[0.5, 0.0, 0.0], precision=precision, alpha=alpha, beta=beta)
    return regression_target(
        prior,
        DESIGN,
        RESPONSE,
        names=("amplitude", "coefficient", "offset"),
        friction="coefficient",
        force_factor=50.0,
    )


PROPER: dict[str, Callable[[], Target]] = {
    "normal_gamma": lambda: normal_gamma_target(NormalGamma(0.1, 0.01, 1.0, 0.02), SAMPLES),
    "normal_gamma_strong": lambda: normal_gamma_target(NormalGamma(-1.0, 30.0, 9.0, 4.0), SAMPLES),
    "gamma_exponential": lambda: gamma_exponential_target(GammaExponential(1.0, 0.02), SAMPLES),
    "gamma_exponential_weak": lambda: gamma_exponential_target(GammaExponential(1e-3, 1e-6), SAMPLES),
    "regression": lambda: nig(2.0, 1.5, 0.3),
    "regression_weak": lambda: nig(1e-12, 0.5, 0.5e-12),
}
FLAT: dict[str, Callable[[], Target]] = {
    "normal_gamma": lambda: normal_gamma_target(NormalGamma(0.0, 0.0, -0.5, 0.0), SAMPLES),
    "gamma_exponential": lambda: gamma_exponential_target(GammaExponential(0.0, 0.0), SAMPLES),
    "regression": lambda: nig(0.0, -1.5, 0.0),
}
ALL = {
    **{f"{name}": make for name, make in PROPER.items()},
    **{f"flat_{name}": make for name, make in FLAT.items()},
}


def points(target: Target, rng: np.random.Generator, size: int = 300) -> np.ndarray:
    """Points up to several times as far from the centre as an ensemble starts."""
    root = np.linalg.cholesky(target.covariance)
    return target.centre + 4.0 * rng.standard_normal((size, len(target.names))) @ root.T


def spread(log_prob: Callable[[np.ndarray], np.ndarray], target: Target, theta: np.ndarray) -> float:
    """Range over parameter space of what must be one constant."""
    return float(np.ptp(log_prob(theta) - target.closed_form(theta)))


@pytest.mark.parametrize("name", ALL)
def test_difference_is_one_constant(name: str, rng: np.random.Generator) -> None:
    target = ALL[name]()
    theta = points(target, rng)
    size = np.abs(target.log_prob(theta)).max()
    assert spread(target.log_prob, target, theta) < 1e-11 * max(size, 1.0)


@pytest.mark.parametrize("name", ALL)
def test_a_missing_jacobian_is_seen(name: str, rng: np.random.Generator) -> None:
    target = ALL[name]()
    # the logarithm of the scale parameter is the last coordinate and its own log-Jacobian
    assert spread(lambda t: target.log_prob(t) - t[:, -1], target, points(target, rng)) > 0.5


@pytest.mark.parametrize(
    ("name", "evidence"),
    [
        ("normal_gamma", lambda: NormalGamma(0.1, 0.01, 1.0, 0.02).log_evidence(SAMPLES)),
        ("gamma_exponential", lambda: GammaExponential(1.0, 0.02).log_evidence(SAMPLES)),
        (
            "regression",
            lambda: NormalInverseGamma.from_prior(
                mean=[0.5, 0.0, 0.0], precision=2.0, alpha=1.5, beta=0.3
            ).log_evidence(DESIGN, RESPONSE),
        ),
    ],
)
def test_the_constant_is_the_evidence(
    name: str, evidence: Callable[[], float], rng: np.random.Generator
) -> None:
    target = PROPER[name]()
    theta = points(target, rng, 5)
    assert target.log_prob(theta) - target.closed_form(theta) == pytest.approx(
        np.full(5, evidence()), abs=1e-9
    )


@pytest.mark.parametrize("name", ALL)
def test_pointwise_sums_to_the_likelihood(name: str, rng: np.random.Generator) -> None:
    target = ALL[name]()
    theta = points(target, rng, 20)
    pointwise = target.pointwise(theta)
    assert pointwise.shape == (20, target.observed.size)
    assert pointwise.sum(axis=1) == pytest.approx(target.log_prob(theta) - target.log_prior(theta), rel=1e-9)


@pytest.mark.parametrize("name", ALL)
def test_nothing_overflows_far_away(name: str) -> None:
    target = ALL[name]()
    far = np.repeat(target.centre[None], 4, axis=0)
    far[:, -1] = [-1e4, -500.0, 500.0, 1e4]
    assert np.all(target.log_prob(far) == -np.inf)
    assert np.all(target.closed_form(far) == -np.inf)


@pytest.mark.parametrize("name", ["normal_gamma", "gamma_exponential", "regression"])
def test_centre_and_covariance_are_the_closed_forms(name: str, rng: np.random.Generator) -> None:
    """Against draws of the posterior itself, brought to the coordinates of the sampler; 5 standard errors."""
    target = PROPER[name]()
    if name == "normal_gamma":
        r, s = NormalGamma(0.1, 0.01, 1.0, 0.02).update(SAMPLES).rvs(40_000, rng)
        theta = np.column_stack([r, np.log(s)])
    elif name == "gamma_exponential":
        theta = np.log(GammaExponential(1.0, 0.02).update(SAMPLES).rvs(40_000, rng))[:, None]
    else:
        prior = NormalInverseGamma.from_prior(mean=[0.5, 0.0, 0.0], precision=2.0, alpha=1.5, beta=0.3)
        b, v = prior.update(DESIGN, RESPONSE).rvs(40_000, rng)
        theta = np.column_stack([b, np.log(v)])
    sd = np.sqrt(np.diag(target.covariance))
    assert np.all(np.abs(theta.mean(axis=0) - target.centre) < 5.0 / 200.0 * sd)
    off = np.cov(theta.T).reshape(target.covariance.shape) - target.covariance
    assert np.all(np.abs(off) < 0.1 * np.outer(sd, sd))


def test_starts_spread_even_where_no_variance_exists() -> None:
    target = normal_gamma_target(NormalGamma(0.0, 1e-12, 0.5, 1e-12), SAMPLES[:1])
    assert np.all(np.isfinite(target.covariance))
    assert np.all(np.diag(target.covariance) > 0.0)


@pytest.mark.parametrize("name", PROPER)
def test_prior_draws_follow_the_prior(name: str, rng: np.random.Generator) -> None:
    target = PROPER[name]()
    draws = target.prior_draws(rng, 4000)
    assert np.all(np.isfinite(draws))
    shape, rate = {
        "normal_gamma": (1.0, 0.02),
        "normal_gamma_strong": (9.0, 4.0),
        "gamma_exponential": (1.0, 0.02),
        "gamma_exponential_weak": (1e-3, 1e-6),
        "regression": (1.5, 0.3),
        "regression_weak": (0.5, 0.5e-12),
    }[name]
    log_gamma = -draws[:, -1] if name.startswith("regression") else draws[:, -1]
    assert stats.kstest(log_gamma + np.log(rate), stats.loggamma(shape).cdf).pvalue > 1e-4
    if name == "normal_gamma_strong":
        assert stats.kstest(draws[:, 0], NormalGamma(-1.0, 30.0, 9.0, 4.0).friction.cdf).pvalue > 1e-4
    if name == "regression":
        prior = NormalInverseGamma.from_prior(mean=[0.5, 0.0, 0.0], precision=2.0, alpha=1.5, beta=0.3)
        assert stats.kstest(draws[:, 0], prior.marginal(0).cdf).pvalue > 1e-4


@pytest.mark.parametrize("name", FLAT)
def test_flat_priors_have_no_draws(name: str, rng: np.random.Generator) -> None:
    with pytest.raises(InputError, match="is improper and has no draws"):
        FLAT[name]().prior_draws(rng, 3)


@pytest.mark.parametrize("name", PROPER)
def test_predictive_replicates_the_data(name: str, rng: np.random.Generator) -> None:
    target = PROPER[name]()
    theta = np.repeat(target.centre[None], 4000, axis=0)
    replicated = target.predictive(theta, rng)
    assert replicated.shape == (4000, target.observed.size)
    # the likelihood of the observed data is the density of what is replicated
    if name.startswith("gamma"):
        assert replicated.mean() == pytest.approx(np.exp(-target.centre[0]), rel=0.05)
        return
    at_mode = target.pointwise(theta[:1])[0]
    mean, sd = replicated.mean(axis=0), replicated.std(axis=0)
    assert stats.norm.logpdf(target.observed, mean, sd) == pytest.approx(at_mode, abs=0.4)


def test_natural_parameters() -> None:
    theta = np.array([[1.0, 0.4, -0.2, np.log(0.01)]])
    natural = nig(1.0, 1.0, 1.0).posterior(theta)
    assert {name: float(value[0]) for name, value in natural.items()} == pytest.approx(
        {"friction": 20.0, "amplitude": 1.0, "offset": -0.2, "precision": 100.0}
    )
    natural = PROPER["normal_gamma"]().posterior(np.array([[0.07, 2.0]]))
    assert natural["friction"][0] == 0.07
    assert natural["precision"][0] == pytest.approx(np.exp(2.0))
    assert PROPER["gamma_exponential"]().posterior(np.array([[2.0]]))["friction"][0] == pytest.approx(
        np.exp(2.0)
    )


def test_names_must_fit() -> None:
    prior = NormalInverseGamma.from_prior(mean=np.zeros(3), precision=1.0, alpha=1.0, beta=1.0)
    with pytest.raises(InputError, match="names: a, b of 3 coefficients"):
        regression_target(prior, DESIGN, RESPONSE, names=("a", "b"), friction="b")


def test_a_target_is_frozen() -> None:
    target = PROPER["gamma_exponential"]()
    assert replace(target, observed_name="drop").observed_name == "drop"


@pytest.mark.parametrize("sample", [0.0, 0.71, 1e8])
def test_a_sampler_starts_as_wide_as_one_sample_leaves_it(sample: float) -> None:
    # nothing shows the scatter of one sample: the width is the prior's, below the last digit of 0.71
    target = normal_gamma_target(NormalGamma(0.0, 0.0, 0.5, 1e-33), [sample])
    # Student t of two degrees of freedom and scale sqrt(beta/alpha): half of its central 68 %
    assert np.sqrt(target.covariance[0, 0] / 1e-33) == pytest.approx(1.3213, rel=1e-3)
