"""Each O(1) log-likelihood against scipy's densities, datum by datum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from friction_bayes.conjugate.likelihood import (
    exponential_log_likelihood,
    exponential_pointwise,
    normal_log_likelihood,
    normal_pointwise,
    regression_log_likelihood,
    regression_pointwise,
)
from friction_bayes.conjugate.sufficient_statistics import NormalStatistics, RegressionStatistics
from friction_bayes.core.errors import InputError


def test_normal(rng: np.random.Generator) -> None:
    x = rng.normal(3.0, 2.0, 17)
    mean, precision = np.array([2.0, 3.5, -1.0]), np.array([0.3, 0.2, 4.0])
    expected = stats.norm.logpdf(x, mean[:, None], precision[:, None] ** -0.5)
    assert normal_pointwise(mean, precision, x) == pytest.approx(expected, rel=1e-12)
    together = normal_log_likelihood(mean, precision, NormalStatistics.of(x))
    assert together == pytest.approx(expected.sum(axis=1), rel=1e-12)


def test_normal_statistics_keep_their_digits() -> None:
    offset = NormalStatistics.of(1e8 + np.arange(10.0))
    assert (offset.n, offset.mean) == (10, 1e8 + 4.5)
    assert offset.sum_of_squares == pytest.approx(82.5, rel=1e-14)
    assert NormalStatistics.of([]) == NormalStatistics(0, 0.0, 0.0)


def test_exponential() -> None:
    x, rate = np.array([0.1, 2.0, 0.4]), np.array([0.7, 3.0])
    expected = stats.expon.logpdf(x, scale=1.0 / rate[:, None])
    assert exponential_pointwise(rate, x) == pytest.approx(expected, rel=1e-12)
    assert exponential_log_likelihood(rate, n=3, total=2.5) == pytest.approx(expected.sum(axis=1), rel=1e-12)
    # formal: a negative sample only enters the sum
    assert exponential_log_likelihood(2.0, n=2, total=-0.5) == pytest.approx(2.0 * np.log(2.0) + 1.0)


@pytest.mark.parametrize("rows", [2, 3, 40])
def test_regression(rows: int, rng: np.random.Generator) -> None:
    x, y = rng.normal(size=(rows, 3)), rng.normal(size=rows)
    b, v = rng.normal(size=(5, 3)), np.array([0.2, 1.0, 3.0, 0.5, 9.0])
    expected = stats.norm.logpdf(y, b @ x.T, np.sqrt(v)[:, None])
    assert regression_pointwise(b, v, x, y) == pytest.approx(expected, rel=1e-10)
    together = regression_log_likelihood(b, v, RegressionStatistics.of(x, y))
    assert together == pytest.approx(expected.sum(axis=1), rel=1e-10)


def test_not_finite_is_refused() -> None:
    with pytest.raises(InputError, match="samples: entry 2 is inf"):
        NormalStatistics.of([0.0, 1.0, np.inf])
