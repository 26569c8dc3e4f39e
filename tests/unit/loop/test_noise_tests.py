"""Tests of residuals where there are none, and of several records together."""

from __future__ import annotations

import numpy as np
import pytest

from friction_bayes.loop.checks.noise_tests import Channel, ResidualTests, noise_tests, worst_of


def test_of_no_samples_none_fails() -> None:
    """Of a record that clips none may be left."""
    assert not ResidualTests(noise_tests(np.zeros(0)), 0.0).failed


def test_of_several_records_the_worst_counts_as_the_least_of_as_many() -> None:
    each = [ResidualTests((Channel("tails", p, 1, p),), 1.0) for p in (0.4, 0.02, 0.3)]
    (worst,) = worst_of(each).channels
    assert worst.statistic == 0.02
    assert worst.p_value == pytest.approx(1.0 - 0.98**3)
