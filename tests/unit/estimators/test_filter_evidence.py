"""What the evidence for filters leaves of a signal."""

from __future__ import annotations

import numpy as np
import pytest

from friction_bayes.estimators.noise.filter_evidence import _residual, likely_filters

SAMPLES = 400


def test_a_column_of_rounding_explains_nothing(rng: np.random.Generator) -> None:
    """Whitening leaves no more of some columns; free coefficients would fit the noise with them."""
    noise = 1e-3 * rng.standard_normal(SAMPLES)
    swing = np.cos(0.3 * np.arange(SAMPLES))
    rounding = 1e-17 * rng.standard_normal((20, SAMPLES))
    signal = 2.0 * swing + noise
    alone = _residual(signal, swing[None], 1e-3)
    np.testing.assert_allclose(_residual(signal, np.vstack([swing, rounding]), 1e-3), alone, atol=1e-12)
    np.testing.assert_allclose(alone, _residual(signal, swing[None]), atol=1e-8)


def test_a_second_fit_takes_what_rounding_left_of_the_first(rng: np.random.Generator) -> None:
    """Columns that nearly agree have large coefficients that nearly cancel."""
    swing, other = np.cos(0.3 * np.arange(SAMPLES)), rng.standard_normal(SAMPLES)
    rows = np.vstack([swing, swing + 1e-4 * other])
    left = _residual(3.0 * swing + other, rows)
    assert np.max(np.abs(left)) < 2e-3


@pytest.mark.parametrize(("samples", "angle"), [(10, 1.6), (16, 1.0), (36, 1.6), (45, 0.5)])
def test_too_few_samples_decide_on_no_filter(rng: np.random.Generator, samples: int, angle: float) -> None:
    phase = angle * np.arange(samples)
    swing = np.column_stack([np.cos(phase), np.sin(phase)])
    signal = swing[:, 0] + 1e-3 * rng.standard_normal(samples)
    found = likely_filters(signal, np.zeros(samples), swing, swing, angle, 0)
    assert not found.kinds
    assert found.likely == []
    assert found.probability == 0.0
