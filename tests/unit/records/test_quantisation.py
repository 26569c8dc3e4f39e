"""The step of the digitiser as the samples show it."""

from __future__ import annotations

import numpy as np
import pytest

from friction_bayes.records.quantisation import quantisation_step


def decay(rng: np.random.Generator, n: int, noise: float) -> np.ndarray:
    i = np.arange(n)
    return np.cos(0.0313 * i) * np.exp(-i / n) + noise * rng.standard_normal(n)


@pytest.mark.parametrize("n", [300, 5000])
@pytest.mark.parametrize("step", [1.0 / 700.0, 0.02])
def test_the_step_is_found_with_noise_and_few_printed_digits(
    rng: np.random.Generator, n: int, step: float
) -> None:
    x = 0.123 + step * np.round(decay(rng, n, 0.3 * step) / step)
    assert quantisation_step(x) == pytest.approx(step, rel=1e-6)
    # a hundredth of a step lost in print
    assert quantisation_step(np.round(x / (0.1 * step)) * 0.1 * step) == pytest.approx(step, rel=0.01)


@pytest.mark.parametrize("n", [30, 300, 5000])
def test_a_continuous_signal_has_none(rng: np.random.Generator, n: int) -> None:
    found = [quantisation_step(decay(rng, n, noise)) for noise in (0.0, 1e-6, 1e-3) for _ in range(40)]
    assert found == [None] * 120


def test_a_filter_leaves_none(rng: np.random.Generator) -> None:
    x = np.round(decay(rng, 5000, 0.0), 2)
    assert quantisation_step(np.convolve(x, rng.dirichlet(np.ones(5)), mode="valid")) is None


def test_a_constant_has_none() -> None:
    assert quantisation_step(np.zeros(100)) is None
