"""The probability of a box under a multivariate normal, against SciPy's integral."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from experiments.simulation.box_probability import log_box_probability

MEAN = np.array([0.4, -0.6])
COVARIANCE = np.array([[1.0, -0.7], [-0.7, 1.5]])
ZERO, FAR = np.zeros(2), np.full(2, math.inf)


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
