"""Conjugate linear regression: certified values, brute force, conditioning, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.multivariate_t import MultivariateT
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.conjugate.sufficient_statistics import RegressionStatistics
from friction_bayes.core.errors import InputError

# NIST Statistical Reference Datasets, linear regression: y and x of Norris (lower difficulty)
NORRIS = """
0.1 0.2 338.8 337.4 118.1 118.2 888.0 884.6 9.2 10.1 228.1 226.5 668.5 666.3 998.5 996.3 449.1 448.6
778.9 777.0 559.2 558.2 0.3 0.4 0.1 0.6 778.1 775.5 668.8 666.9 339.3 338.0 448.9 447.5 10.8 11.6
557.7 556.0 228.3 228.1 998.0 995.8 888.8 887.6 119.6 120.2 0.3 0.3 0.6 0.3 557.6 556.8 339.3 339.1
888.0 887.2 998.5 999.0 778.9 779.0 10.2 11.1 117.6 118.3 228.9 229.2 668.4 669.1 449.2 448.9 0.2
0.5
"""
# ... and Longley (higher difficulty: condition number 5e9): y, x1 ... x5; x6 is the year from 1947
LONGLEY = """
60323 61122 60171 61187 63221 63639 64989 63761 66019 67857 68169 66513 68655 69564 69331 70551 83.0
88.5 88.2 89.5 96.2 98.1 99.0 100.0 101.2 104.6 108.4 110.8 112.6 114.2 115.7 116.9 234289 259426
258054 284599 328975 346999 365385 363112 397469 419180 442769 444546 482704 502601 518173 554894
2356 2325 3682 3351 2099 1932 1870 3578 2904 2822 2936 4681 3813 3931 4806 4007 1590 1456 1616 1650
3099 3594 3547 3350 3048 2857 2798 2637 2552 2514 2572 2827 107608 108632 109773 110929 112075
113270 115094 116219 117388 118734 120445 121950 123366 125368 127852 130081
"""


def flat(size: int) -> NormalInverseGamma:
    return NormalInverseGamma.from_prior(mean=np.zeros(size), precision=0.0, alpha=-0.5 * size, beta=0.0)


@pytest.fixture
def problem(rng: np.random.Generator) -> tuple[NormalInverseGamma, np.ndarray, np.ndarray]:
    prior = NormalInverseGamma.from_prior(
        mean=[1.0, -2.0], precision=[[2.0, 0.5], [0.5, 1.0]], alpha=2.0, beta=3.0
    )
    design = rng.normal(size=(6, 2))
    return prior, design, design @ [0.5, -1.0] + rng.normal(size=6)


def test_norris_certified() -> None:
    y, x = np.array(NORRIS.split(), dtype=float).reshape(-1, 2).T
    after = flat(2).update(np.column_stack([np.ones(36), x]), y)
    assert after.mean == pytest.approx([-0.262323073774029, 1.00211681802045], rel=1e-11)
    assert math.sqrt(after.beta / after.alpha) == pytest.approx(0.884796396144373, rel=1e-12)
    sd = np.sqrt(np.diag(after.coefficients.shape))
    assert sd == pytest.approx([0.232818234301152, 0.429796848199937e-03], rel=1e-11)


def test_longley_certified() -> None:
    y, *x = np.array(LONGLEY.split(), dtype=float).reshape(6, 16)
    after = flat(7).update(np.column_stack([np.ones(16), *x, np.arange(1947, 1963)]), y)
    certified = [
        -3482258.63459582,
        15.0618722713733,
        -0.358191792925910e-01,
        -2.02022980381683,
        -1.03322686717359,
        -0.511041056535807e-01,
        1829.15146461355,
    ]
    assert after.mean == pytest.approx(certified, rel=1e-9)
    assert math.sqrt(after.beta / after.alpha) == pytest.approx(304.854073561965, rel=1e-10)
    assert after.marginal(6).kwds["scale"] == pytest.approx(455.478499142212, rel=1e-10)


def test_update_by_the_textbook(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray]) -> None:
    prior, x, y = problem
    after = prior.update(x, y)
    precision = prior.precision + x.T @ x
    mean = np.linalg.solve(precision, prior.precision @ prior.mean + x.T @ y)
    beta = 3.0 + 0.5 * (y @ y + prior.mean @ prior.precision @ prior.mean - mean @ precision @ mean)
    assert after.precision == pytest.approx(precision, rel=1e-12)
    assert after.mean == pytest.approx(mean, rel=1e-12)
    assert (after.alpha, after.beta) == pytest.approx((5.0, beta), rel=1e-12)


def test_one_constant_column_is_the_normal_gamma_pair() -> None:
    samples = np.array([0.3, 0.7, 0.2])
    pair = NormalGamma(0.1, 0.5, 1.5, 0.2)
    regression = NormalInverseGamma.from_prior(mean=0.1, precision=0.5, alpha=1.5, beta=0.2)
    a, b = pair.update(samples), regression.update(np.ones((3, 1)), samples)
    assert (b.mean[0], b.precision[0, 0], b.alpha, b.beta) == pytest.approx((a.mu, a.lam, a.alpha, a.beta))
    assert regression.log_evidence(np.ones((3, 1)), samples) == pytest.approx(pair.log_evidence(samples))
    # density of the variance v = 1/s takes the factor 1/v**2
    assert b.logpdf([0.2], 0.04) == pytest.approx(a.logpdf(0.2, 25.0) + 2.0 * math.log(25.0))


def test_evidence_is_the_prior_predictive(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray]) -> None:
    prior, x, y = problem
    evidence = prior.log_evidence(x, y)
    assert evidence == pytest.approx(float(prior.predictive(x).logpdf(y)), abs=1e-10)
    shape = 1.5 * (np.eye(6) + x @ np.linalg.inv(prior.precision) @ x.T)
    assert evidence == pytest.approx(stats.multivariate_t(x @ prior.mean, shape, 4.0).logpdf(y), abs=1e-10)
    apart = prior.log_evidence(x[:2], y[:2]) + prior.update(x[:2], y[:2]).log_evidence(x[2:], y[2:])
    assert evidence == pytest.approx(apart, abs=1e-10)


def test_joint_density_is_bayes_rule(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray]) -> None:
    prior, x, y = problem
    b, v = np.array([0.4, -1.2]), 1.7
    likelihood = stats.norm.logpdf(y, x @ b, math.sqrt(v)).sum()
    expected = prior.logpdf(b, v) + likelihood - prior.log_evidence(x, y)
    assert prior.update(x, y).logpdf(b, v) == pytest.approx(float(expected), abs=1e-10)
    assert prior.logpdf(b, -1.0) == -np.inf


def test_marginals_of_the_joint_density(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray]) -> None:
    after = problem[0].update(*problem[1:])
    v = np.exp(np.linspace(-9.0, 12.0, 20_001))
    density = np.exp(after.logpdf(np.array([0.5, -1.0]), v)) * v
    assert np.trapezoid(density, np.log(v)) == pytest.approx(
        float(after.coefficients.pdf([0.5, -1.0])), rel=1e-9
    )
    given = after.logpdf(after.mean, v) + math.log(2.0 * math.pi) + np.log(v) - after._log_factor
    assert given == pytest.approx(after.variance.logpdf(v), abs=1e-9)


def test_linear_combination(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray]) -> None:
    after = problem[0].update(*problem[1:])
    c = np.array([2.0, -0.5])
    combined = after.linear(c)
    assert combined.mean() == pytest.approx(c @ after.mean)
    assert combined.kwds["scale"] ** 2 == pytest.approx(c @ after.coefficients.shape @ c)
    assert after.marginal(1).kwds["loc"] == after.mean[1]
    with pytest.raises(InputError, match="give 2 weights"):
        after.linear([1.0])


def test_draws(problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray], rng: np.random.Generator) -> None:
    # four tests at 1e-4 each
    after = problem[0].update(*problem[1:])
    b, v = after.rvs(20_000, rng)
    assert stats.kstest(v, after.variance.cdf).pvalue > 1e-4
    for weights in ([1.0, 0.0], [0.0, 1.0], [1.0, 1.0]):
        assert stats.kstest(b @ weights, after.linear(weights).cdf).pvalue > 1e-4


def test_an_offset_of_1e8_costs_no_digits() -> None:
    time = np.linspace(0.0, 1.0, 50)
    scatter = np.cos(40.0 * time)
    design = np.column_stack([np.ones(50), time])
    low, high = flat(2).update(design, scatter), flat(2).update(design, scatter + 1e8)
    assert high.beta == pytest.approx(low.beta, rel=1e-7)
    assert high.mean[0] - 1e8 == pytest.approx(low.mean[0], abs=1e-6)


def test_columns_of_very_different_scale(rng: np.random.Generator) -> None:
    """A cubic trend over 1e4 s: the variances of the coefficients differ by 1e24."""
    time = np.linspace(0.0, 1.0, 200)
    y = 1.0 + time + rng.normal(size=200)
    plain = flat(4).update(np.vander(time, increasing=True, N=4), y)
    stretched = flat(4).update(np.vander(1e4 * time, increasing=True, N=4), y)
    scale = 1e4 ** np.arange(4)
    assert stretched.mean * scale == pytest.approx(plain.mean, rel=1e-8)
    at = stretched.mean + 0.5 * np.sqrt(np.diag(stretched.coefficients.shape))
    shift = np.log(scale).sum()
    assert stretched.coefficients.logpdf(at) == pytest.approx(
        float(plain.coefficients.logpdf(at * scale)) + shift
    )


def test_reduced_statistics_in_place_of_rows(
    problem: tuple[NormalInverseGamma, np.ndarray, np.ndarray],
) -> None:
    prior, x, y = problem
    a, b = prior.update(x, y), prior.update_statistics(RegressionStatistics.of(x, y))
    assert np.array_equal(a.mean, b.mean)
    assert prior.update(np.empty((0, 2)), np.empty(0)) is prior


def test_multivariate_t_is_scipys(rng: np.random.Generator) -> None:
    root = np.array([[2.0, 0.7], [0.0, 1.5]])
    ours = MultivariateT(np.array([1.0, -1.0]), root, 5.0)
    theirs = stats.multivariate_t([1.0, -1.0], np.linalg.inv(root.T @ root), 5.0)
    x = rng.normal(size=(7, 2))
    assert ours.shape == pytest.approx(theirs.shape)
    assert ours.logpdf(x) == pytest.approx(theirs.logpdf(x), abs=1e-12)
    assert ours.entropy() == pytest.approx(float(theirs.entropy()), abs=1e-10)
    assert ours.cov() == pytest.approx(theirs.shape * 5.0 / 3.0)
    assert ours.cdf([1.3, 0.0], random_state=rng) == pytest.approx(
        theirs.cdf([1.3, 0.0], random_state=rng), abs=1e-3
    )
    draws = ours.rvs(20_000, random_state=rng)
    assert stats.kstest(draws @ [1.0, 2.0], ours.linear([1.0, 2.0]).cdf).pvalue > 1e-4
    with pytest.raises(TypeError, match="random_state"):
        ours.rvs(3)
    np.testing.assert_array_equal(
        ours.rvs(3, random_state=7), ours.rvs(3, random_state=np.random.default_rng(7))
    )


@pytest.mark.parametrize("alpha", [0.0, -0.5, -1.5, -4.0])
def test_flat_priors(alpha: float, rng: np.random.Generator) -> None:
    prior = NormalInverseGamma.from_prior(mean=np.zeros(3), precision=0, alpha=alpha, beta=0)
    design = rng.normal(size=(12, 3))
    response = rng.normal(size=12)
    after = prior.update(design, response)
    least_squares, (rss,), *_ = np.linalg.lstsq(design, response)
    assert after.mean == pytest.approx(least_squares)
    assert (after.alpha, after.beta) == pytest.approx((alpha + 6.0, 0.5 * rss))
    for refused in (
        lambda: prior.coefficients,
        lambda: prior.variance,
        lambda: prior.log_evidence(design, response),
        lambda: prior.rvs(2, rng),
        lambda: prior.predictive(design),
        lambda: prior.logpdf(np.zeros(3), 1.0),
    ):
        with pytest.raises(InputError, match="precision of rank 0 of 3 is improper"):
            refused()


def test_undetermined_coefficients_are_named(rng: np.random.Generator) -> None:
    x = rng.normal(size=(9, 3)) * [1.0, 1e-6, 1e5]
    x[:, 2] = x[:, 0] - 3e6 * x[:, 1]
    y = rng.normal(size=9)
    with pytest.raises(InputError, match=r"design: rank 2 with 3 columns: column \d depends linearly"):
        flat(3).update(x, y)
    with pytest.raises(InputError, match="rank 2 with 3 columns"):
        flat(3).update(rng.normal(size=(2, 3)), y[:2])
    with pytest.raises(InputError, match="column 1 depends"):
        flat(2).update(np.column_stack([np.ones(9), np.zeros(9)]), y)
    proper = NormalInverseGamma.from_prior(mean=np.zeros(3), precision=1e-6, alpha=1.0, beta=1.0)
    assert np.all(np.isfinite(proper.update(x, y).mean))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"precision": -1.0}, "precision: -1 is negative"),
        ({"precision": [1.0, 2.0, 3.0]}, "precision: has shape"),
        ({"precision": [[1.0, 2.0], [0.0, 1.0]]}, "is not symmetric"),
        ({"precision": [[1.0, 2.0], [2.0, 1.0]]}, "negative eigenvalue"),
        ({"mean": [[1.0, 2.0]]}, "mean: has shape"),
        ({"mean": [1.0, math.nan]}, "mean: entry 1 is nan"),
        ({"beta": -1.0}, "beta: -1 is negative"),
        ({"alpha": math.nan}, "alpha: nan is not finite"),
    ],
)
def test_bad_priors_are_named(changed: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"mean": [0.0, 0.0], "precision": 1.0, "alpha": 1.0, "beta": 1.0}
    with pytest.raises(InputError, match=message):
        NormalInverseGamma.from_prior(**{**good, **changed})  # type: ignore[arg-type]


def test_bad_data_are_named() -> None:
    prior = flat(2)
    with pytest.raises(InputError, match="response: has shape"):
        prior.update(np.ones((3, 2)), np.ones(4))
    with pytest.raises(InputError, match="design: has 3 columns; give 2"):
        prior.update(np.ones((4, 3)), np.ones(4))
    with pytest.raises(InputError, match="design: has shape"):
        prior.update(np.ones(4), np.ones(4))
    with pytest.raises(InputError, match="response: entry 2 is inf"):
        prior.update(np.ones((3, 2)), [0.0, 1.0, math.inf])
