"""A motion between its samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes.statespace.measured_path import MeasuredPath


@pytest.mark.parametrize("start", [0.0, 0.013, 0.031])
def test_what_samples_miss_of_a_jump_is_the_mean_about_them(start: float) -> None:
    """The sign of a sine, averaged over a step about each sample, less its sign there."""
    step = 0.05
    phase = start + step * np.arange(300)
    path = MeasuredPath.through(phase, np.cos(phase), -np.sin(phase))
    fine = phase[:, None] + step * ((np.arange(1000) + 0.5) / 1000.0 - 0.5)
    expected = np.sign(-np.sin(fine)).mean(axis=1) - np.sign(-np.sin(phase))
    expected[[0, -1]] = 0.0
    missed = path.missed_jumps(2)
    np.testing.assert_allclose(missed[1:-1], expected[1:-1], atol=5e-3)
    assert np.count_nonzero(missed) == math.floor(phase[-1] / math.pi)
    assert not path.missed_jumps(1).any()
