from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from friction_bayes.loop.infer.truncated_normal import (
    log_box_probability,
    log_interval_probability,
    truncated_draws,
)

MEAN = np.array([0.4, -0.6])
COVARIANCE = np.array([[1.0, -0.7], [-0.7, 1.5]])
ZERO, FAR = np.zeros(2), np.full(2, math.inf)


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (-math.inf, math.inf, 0.0),
        (0.0, math.inf, math.log(0.5)),
        (-1.0, 2.0, math.log(stats.norm.cdf(2.0) - stats.norm.cdf(-1.0))),
        (40.0, math.inf, float(stats.norm.logsf(40.0))),
        (-41.0, -40.0, float(stats.norm.logcdf(-40.0))),
    ],
)
def test_interval_probability_holds_in_the_tails(low: float, high: float, expected: float) -> None:
    assert log_interval_probability(np.array([low]), np.array([high]))[0] == pytest.approx(expected, rel=1e-9)


def test_box_probability_is_near_the_integral() -> None:
    exact = stats.multivariate_normal.cdf(
        FAR, mean=MEAN, cov=COVARIANCE, lower_limit=ZERO, rng=np.random.default_rng(1)
    )
    assert log_box_probability(MEAN, COVARIANCE, ZERO, FAR) == pytest.approx(math.log(exact), abs=0.02)


@pytest.mark.parametrize("k", [3, 4, 5, 6])
def test_box_probability_of_several_coordinates_is_the_integral(k: int, rng: np.random.Generator) -> None:
    """Strongly correlated, some bounded on both sides, the mean in part outside."""
    root = rng.standard_normal((k, k + 1))
    covariance = root @ root.T
    sd = np.sqrt(np.diag(covariance))
    mean = rng.uniform(-0.5, 1.0, k) * sd
    low, high = np.zeros(k), np.where(np.arange(k) % 2, 2.0 * sd, math.inf)
    exact = stats.multivariate_normal.cdf(
        high, mean=mean, cov=covariance, lower_limit=low, rng=np.random.default_rng(1)
    )
    assert log_box_probability(mean, covariance, low, high) == pytest.approx(math.log(exact), abs=0.02)


def test_the_coordinates_beyond_six_count_as_independent() -> None:
    """The two that bind least are independent of the others: their probabilities multiply."""
    k = 8
    covariance = np.eye(k)
    covariance[:6, :6] += 0.6 * (1.0 - np.eye(6))
    mean = np.array([0.2] * 6 + [1.0, 1.5])
    exact = stats.multivariate_normal.cdf(
        np.full(k, math.inf), mean=mean, cov=covariance, lower_limit=np.zeros(k), rng=np.random.default_rng(1)
    )
    found = log_box_probability(mean, covariance, np.zeros(k), np.full(k, math.inf))
    assert found == pytest.approx(math.log(exact), abs=0.02)


def test_box_probability_far_out_falls_like_the_density() -> None:
    """Thirty standard deviations outside in both of two coordinates: no floor makes it probable."""
    out = log_box_probability(np.array([-30.0, -30.0]), np.eye(2), ZERO, FAR)
    assert out == pytest.approx(2.0 * float(stats.norm.logcdf(-30.0)))


def test_draws_lie_inside_and_have_the_moments_of_the_cut_normal(rng: np.random.Generator) -> None:
    n = 20_000
    drawn = truncated_draws(MEAN, COVARIANCE, ZERO, FAR, rng, n)
    assert drawn.min() >= 0.0
    plain = rng.multivariate_normal(MEAN, COVARIANCE, 40 * n)
    kept = plain[(plain > 0.0).all(axis=1)]
    # resampling leaves some 60 % of the draws distinct; five standard errors
    error = 5.0 * kept.std(axis=0) * math.sqrt(1.0 / (0.5 * n) + 1.0 / len(kept))
    assert np.all(np.abs(drawn.mean(axis=0) - kept.mean(axis=0)) < error)


def test_draws_far_outside_stay_finite(rng: np.random.Generator) -> None:
    drawn = truncated_draws(np.array([-50.0]), np.eye(1), np.zeros(1), np.array([math.inf]), rng, 1000)
    assert np.isfinite(drawn).all()
    # exponential with rate 50
    assert drawn.mean() == pytest.approx(1.0 / 50.0, rel=0.2)
