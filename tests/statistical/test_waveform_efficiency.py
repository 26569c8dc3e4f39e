"""Whole-signal estimates reach the Cramer-Rao bound and their intervals cover, over random systems.

The mean squared error is compared with that of the efficient linear estimator on the same noise (see
benchmarks/accuracy.py), which leaves little Monte Carlo error. Each test fails by chance in about one run of
30,000 (4 standard errors, one or two sides).
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.accuracy import measure, random_decay
from experiments.cramer_rao import paper_decay

SYSTEMS = 40
REPEATS = 8


@pytest.mark.parametrize("order", [0, 1], ids=["displacement", "velocity"])
@pytest.mark.parametrize("decibels", [12.0, 25.0])
def test_efficiency_and_coverage_over_random_systems(
    order: int, decibels: float, rng: np.random.Generator
) -> None:
    decays = [(random_decay(rng, order), 1.0) for _ in range(SYSTEMS)]
    linear, figures = measure(decays, decibels, REPEATS, rng, ["waveform"])
    error, hit, _ = figures["waveform"]
    assert np.all(np.isfinite(error))
    # records of one system share their half cycles: its mean is the independent unit
    excess = (error**2 - linear**2).reshape(SYSTEMS, REPEATS).mean(axis=1)
    standard_error = excess.std(ddof=1) / np.sqrt(SYSTEMS)
    assert excess.mean() < 1.0 / 0.97 - 1.0 + 4.0 * standard_error
    assert standard_error < 0.05
    count = hit.size
    assert abs(hit.mean() - 0.9) < 0.02 + 4.0 * np.sqrt(0.09 / count)


def test_paper_example_reaches_the_bound(rng: np.random.Generator) -> None:
    linear, figures = measure([(paper_decay(0), 0.0147)], 21.0, 40, rng, ["waveform"])
    error, hit, _ = figures["waveform"]
    assert np.mean(error**2 - linear**2) == pytest.approx(0.0, abs=0.03)
    assert hit.sum() >= 27
