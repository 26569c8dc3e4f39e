from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from experiments.simulation.truncated_normal import log_interval_probability, truncated_draws
from friction_bayes.loop.infer.normal_above import draws_above

MEAN = np.array([0.4, -0.6])
COVARIANCE = np.array([[1.0, -0.7], [-0.7, 1.5]])
ZERO = np.zeros(2)


def in_box(
    low: np.ndarray, mean: np.ndarray, covariance: np.ndarray, rng: np.random.Generator, draws: int
) -> np.ndarray:
    """As the simulation draws."""
    return truncated_draws(mean, covariance, low, np.full(low.size, math.inf), rng, draws)


@pytest.fixture(params=[draws_above, in_box])
def drawn_above(request: pytest.FixtureRequest) -> Callable[..., np.ndarray]:
    return request.param


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


def test_draws_lie_inside_and_have_the_moments_of_the_cut_normal(
    drawn_above: Callable[..., np.ndarray], rng: np.random.Generator
) -> None:
    n = 20_000
    drawn = drawn_above(ZERO, MEAN, COVARIANCE, rng, n)
    assert drawn.min() >= 0.0
    plain = rng.multivariate_normal(MEAN, COVARIANCE, 40 * n)
    kept = plain[(plain > 0.0).all(axis=1)]
    # resampling leaves some 60 % of the draws distinct; five standard errors
    error = 5.0 * kept.std(axis=0) * math.sqrt(1.0 / (0.5 * n) + 1.0 / len(kept))
    assert np.all(np.abs(drawn.mean(axis=0) - kept.mean(axis=0)) < error)


def test_draws_far_outside_stay_finite(
    drawn_above: Callable[..., np.ndarray], rng: np.random.Generator
) -> None:
    drawn = drawn_above(np.zeros(1), np.array([-50.0]), np.eye(1), rng, 1000)
    assert np.isfinite(drawn).all()
    # exponential with rate 50
    assert drawn.mean() == pytest.approx(1.0 / 50.0, rel=0.2)
