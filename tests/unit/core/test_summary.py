"""The summary of an uncertain number, from a distribution and from draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from friction_bayes.core.strict_json import plain
from friction_bayes.core.summary import Summary


def test_of_a_distribution() -> None:
    summary = Summary.of_distribution(stats.norm(2.0, 0.5), "N")
    low, high = summary.interval90
    assert (summary.mean, summary.sd, summary.unit) == (2.0, 0.5, "N")
    assert (low, high) == pytest.approx((2.0 - 0.5 * 1.6448536, 2.0 + 0.5 * 1.6448536), rel=1e-7)


def test_of_draws_of_any_shape() -> None:
    draws = np.arange(21.0).reshape(3, 7)
    summary = Summary.of_draws(draws, "m")
    assert summary == Summary(mean=10.0, sd=draws.std(ddof=1), interval90=(1.0, 19.0), unit="m")
    assert Summary.of_draws(draws, "m", ddof=0).sd == draws.std()


def test_a_moment_that_does_not_exist_is_none() -> None:
    summary = Summary.of_distribution(stats.t(1.0), "N")
    assert math.isnan(summary.mean) or math.isinf(summary.mean)
    found = summary.to_dict()
    assert found["mean"] is None
    assert found["sd"] is None
    assert found["interval90"] == pytest.approx([-6.3137515, 6.3137515])
    assert list(found) == ["mean", "sd", "interval90", "unit"]


def test_plain_values() -> None:
    assert plain({1: (np.float32(0.5), math.inf), "a": np.array([1, 2]), "b": np.bool_(True)}) == {
        "1": [0.5, None],
        "a": [1, 2],
        "b": True,
    }
