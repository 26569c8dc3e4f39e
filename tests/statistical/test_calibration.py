"""Every conjugate model and the sampler, calibrated by simulation; planted bugs are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import friction_bayes as fb
from friction_bayes import testing
from friction_bayes.conjugate.likelihood import Target
from friction_bayes.conjugate.targets import gamma_exponential_target, normal_gamma_target, regression_target
from friction_bayes.reference.ensembles import Ensembles
from friction_bayes.reference.sampling import sample_target
from friction_bayes.validation.calibration import rank_pit

RARE = 1e-4
"""False-alarm rate of what must hold: the suite is also run over many seeds."""
REPLICATIONS = 10_000
FEW = 2_000
"""Enough to find a planted bug."""
SAMPLES = 8

NORMAL_GAMMA = fb.NormalGamma(mu=0.1, lam=0.5, alpha=3.0, beta=0.06)
GAMMA_EXPONENTIAL = fb.GammaExponential(alpha=2.0, kappa=0.3)
DESIGN = np.column_stack([np.ones(SAMPLES), np.arange(SAMPLES) - 3.0])
REGRESSION = fb.NormalInverseGamma.from_prior(mean=[0.2, -0.1], precision=[0.5, 4.0], alpha=3.0, beta=0.2)

Mutation = Callable[..., object]


def normal_gamma(change: Mutation, seed: int, replications: int = REPLICATIONS):
    """Calibrate friction and precision after an analyst's prior or posterior was changed."""

    def simulate(truth: tuple[np.ndarray, ...], rng: np.random.Generator) -> np.ndarray:
        r, s = truth
        return rng.normal(r[:, None], s[:, None] ** -0.5, (r.size, SAMPLES))

    def cdf(data: np.ndarray, truth: tuple[np.ndarray, ...]) -> np.ndarray:
        prior, after = change(NORMAL_GAMMA)
        found = [after(prior.update(x)) for x in data]
        mu, lam, alpha, beta = (
            np.array([getattr(p, k) for p in found]) for k in ("mu", "lam", "alpha", "beta")
        )
        r, s = truth
        friction = stats.t.cdf(r, 2.0 * alpha, mu, np.sqrt(beta / (alpha * lam)))
        return np.column_stack([friction, stats.gamma.cdf(s, alpha, scale=1.0 / beta)])

    return testing.assert_calibrated(
        lambda rng, n: NORMAL_GAMMA.rvs(n, rng),
        simulate,
        cdf,
        replications=replications,
        seed=seed,
        false_alarm_rate=RARE,
    )


def same(posterior):
    return posterior


def half_a_sample_more(posterior):
    return replace(posterior, alpha=posterior.alpha + 0.5)


def test_normal_gamma(seed: int) -> None:
    assert normal_gamma(lambda prior: (prior, same), seed).calibrated


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda prior: (replace(prior, lam=4.0 * prior.lam), same), id="prior twice too narrow"),
        pytest.param(lambda prior: (prior, half_a_sample_more), id="alpha off by 1/2"),
    ],
)
def test_normal_gamma_with_a_planted_bug(seed: int, change: Mutation) -> None:
    with pytest.raises(AssertionError, match="not calibrated over 2000 replications"):
        normal_gamma(change, seed, FEW)


def gamma_exponential(
    after: Mutation, prior: fb.GammaExponential, seed: int, replications: int = REPLICATIONS
):
    def cdf(data: np.ndarray, rate: np.ndarray) -> np.ndarray:
        found = [after(prior.update(x)) for x in data]
        alpha, kappa = (np.array([getattr(p, k) for p in found]) for k in ("alpha", "kappa"))
        return stats.gamma.cdf(rate, alpha, scale=1.0 / kappa)

    return testing.assert_calibrated(
        lambda rng, n: GAMMA_EXPONENTIAL.rvs(n, rng),
        lambda rate, rng: rng.exponential(1.0 / rate[:, None], (rate.size, SAMPLES)),
        cdf,
        replications=replications,
        seed=seed,
        false_alarm_rate=RARE,
    )


def test_gamma_exponential(seed: int) -> None:
    assert gamma_exponential(same, GAMMA_EXPONENTIAL, seed).calibrated


@pytest.mark.parametrize(
    ("after", "prior"),
    [
        pytest.param(half_a_sample_more, GAMMA_EXPONENTIAL, id="alpha off by 1/2"),
        # same mean, half the sd
        pytest.param(same, fb.GammaExponential(alpha=8.0, kappa=1.2), id="prior twice too narrow"),
    ],
)
def test_gamma_exponential_with_a_planted_bug(seed: int, after: Mutation, prior: fb.GammaExponential) -> None:
    with pytest.raises(AssertionError, match="not calibrated"):
        gamma_exponential(after, prior, seed, FEW)


def regression(after: Mutation, prior: fb.NormalInverseGamma, seed: int, replications: int = REPLICATIONS):
    def simulate(truth: tuple[np.ndarray, ...], rng: np.random.Generator) -> np.ndarray:
        b, v = truth
        return b @ DESIGN.T + rng.standard_normal((v.size, SAMPLES)) * np.sqrt(v)[:, None]

    def cdf(data: np.ndarray, truth: tuple[np.ndarray, ...]) -> np.ndarray:
        b, v = truth
        found = [after(prior.update(DESIGN, y)) for y in data]
        mean = np.array([p.mean for p in found])
        alpha, beta = np.array([p.alpha for p in found]), np.array([p.beta for p in found])
        # the same design every time: the relative covariance of the coefficients is one and the same
        spread = np.sqrt(np.diag(np.linalg.inv(found[0].precision)))
        scale = spread * np.sqrt(beta / alpha)[:, None]
        coefficients = stats.t.cdf(b, 2.0 * alpha[:, None], mean, scale)
        return np.column_stack([coefficients, stats.invgamma.cdf(v, alpha, scale=beta)])

    return testing.assert_calibrated(
        lambda rng, n: REGRESSION.rvs(n, rng),
        simulate,
        cdf,
        replications=replications,
        seed=seed,
        false_alarm_rate=RARE,
    )


def test_regression(seed: int) -> None:
    assert regression(same, REGRESSION, seed).calibrated


@pytest.mark.parametrize(
    ("after", "prior"),
    [
        pytest.param(half_a_sample_more, REGRESSION, id="alpha off by 1/2"),
        pytest.param(same, replace(REGRESSION, factor=2.0 * REGRESSION.factor), id="prior twice too narrow"),
    ],
)
def test_regression_with_a_planted_bug(seed: int, after: Mutation, prior: fb.NormalInverseGamma) -> None:
    with pytest.raises(AssertionError, match="not calibrated"):
        regression(after, prior, seed, FEW)


def five_normal(mean: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Five observations of unit sd; the prior of their mean is standard normal."""
    return rng.normal(mean[:, None], 1.0, (mean.size, 5))


def using(observations: int, seed: int, *, likelihood: bool, replications: int = FEW, rate: float = RARE):
    """Calibrate the posterior of a normal mean that uses the first so many observations."""

    def cdf(data: np.ndarray, mean: np.ndarray) -> np.ndarray:
        precision = 1.0 + observations
        centre, sd = data[:, :observations].sum(axis=1) / precision, precision**-0.5
        pit = [stats.norm.cdf(mean, centre, sd)]
        if likelihood:
            rng = np.random.default_rng(seed)
            draws = rng.normal(centre[:, None], sd, (mean.size, 19))
            at = [stats.norm.logpdf(data[:, :, None], x[:, None]).sum(axis=1) for x in (draws, mean[:, None])]
            pit.append(rank_pit(at[0], at[1][:, 0], rng))
        return np.column_stack(pit)

    return testing.assert_calibrated(
        lambda rng, n: rng.standard_normal(n),
        five_normal,
        cdf,
        replications=replications,
        seed=seed,
        false_alarm_rate=rate,
    )


@pytest.mark.parametrize("observations", [0, 1, 3])
def test_data_that_are_not_used_show_in_the_likelihood(observations: int, seed: int) -> None:
    using(observations, seed, likelihood=False)
    with pytest.raises(AssertionError, match="of parameter 1") as reported:
        using(observations, seed, likelihood=True)
    assert "of parameter 0" not in str(reported.value)


def test_false_alarms_with_the_likelihood_are_as_stated(seed: int) -> None:
    runs, rate, alarms = 300, 0.1, 0
    for i in range(runs):
        try:
            using(5, seed + i, likelihood=True, replications=200, rate=rate)
        except AssertionError:
            alarms += 1
    # checks of one parameter are dependent, so that alarms are fewer than stated: 7 % of 1000 runs
    assert stats.binom.ppf(RARE, runs, 0.25 * rate) <= alarms <= stats.binom.isf(RARE, runs, rate)


def test_coverage_of_the_conjugate_intervals(rng: np.random.Generator) -> None:
    r, s = NORMAL_GAMMA.rvs(1000, rng)
    data = rng.normal(r[:, None], s[:, None] ** -0.5, (r.size, SAMPLES))
    intervals = np.array([NORMAL_GAMMA.update(x).friction_interval(0.9) for x in data])
    testing.assert_coverage(intervals[:, 0], intervals[:, 1], r, level=0.9, false_alarm_rate=RARE)
    # the interval of a posterior given every sample twice
    twice = np.array([NORMAL_GAMMA.update(np.tile(x, 2)).friction_interval(0.9) for x in data])
    with pytest.raises(AssertionError, match=r"intervals cover the truth, 0\.9 should"):
        testing.assert_coverage(twice[:, 0], twice[:, 1], r, level=0.9)


def test_sampler_is_calibrated(seed: int) -> None:
    """Two hundred posteriors by emcee: the last places of walkers of independent ensembles are the draws."""
    replications = 200

    def simulate(truth: tuple[np.ndarray, ...], rng: np.random.Generator) -> np.ndarray:
        r, s = truth
        return rng.normal(r[:, None], s[:, None] ** -0.5, (r.size, SAMPLES))

    def cdf(data: np.ndarray, truth: tuple[np.ndarray, ...]) -> np.ndarray:
        r, s = truth
        found = []
        for i, x in enumerate(data):
            run = Ensembles(normal_gamma_target(NORMAL_GAMMA, x), seed=seed + i, ensembles=4, walkers=16)
            # five autocorrelation times: of where the walkers began nothing is left
            run.advance(20)
            last = run.coordinates(19)[:, -1, :].T
            found.append(rank_pit(last, np.array([r[i], np.log(s[i])]), run.rng))
        return np.array(found)

    assert testing.assert_calibrated(
        lambda rng, n: NORMAL_GAMMA.rvs(n, rng),
        simulate,
        cdf,
        replications=replications,
        seed=seed,
        false_alarm_rate=RARE,
    ).calibrated


EMPTY_TARGETS = {
    "normal-gamma": lambda: normal_gamma_target(NORMAL_GAMMA, []),
    "gamma-exponential": lambda: gamma_exponential_target(GAMMA_EXPONENTIAL, []),
    "regression": lambda: regression_target(
        REGRESSION, DESIGN[:0], [], names=("offset", "slope"), friction="slope"
    ),
}


def recover_prior(target: Target, seed: int, rate: float) -> None:
    tree = sample_target(target, seed=seed)
    posterior, ensembles = tree["posterior"], tree.attrs["ensembles"]
    natural = target.posterior(target.prior_draws(np.random.default_rng(seed), 20_000))
    draws = {name: posterior[name].values.reshape(ensembles, tree.attrs["walkers"], -1) for name in natural}
    testing.assert_prior_recovered(draws, natural, false_alarm_rate=rate)


@pytest.mark.parametrize("name", EMPTY_TARGETS)
def test_no_data_leave_the_prior(name: str, seed: int) -> None:
    target = EMPTY_TARGETS[name]()
    recover_prior(target, seed, RARE)
    np.testing.assert_allclose(target.log_prob(target.centre[None]), target.log_prior(target.centre[None]))


@pytest.mark.parametrize("name", EMPTY_TARGETS)
def test_no_data_show_a_missing_jacobian(name: str, seed: int) -> None:
    target = EMPTY_TARGETS[name]()
    jacobian_lost = replace(target, log_prob=lambda theta: target.log_prob(theta) - theta[:, -1])
    with pytest.raises(AssertionError, match="not recovered"):
        recover_prior(jacobian_lost, seed, 0.01)
