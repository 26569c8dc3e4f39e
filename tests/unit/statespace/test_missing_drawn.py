"""What is missing of a residual is drawn from the noise of the rest, as exactly as dense algebra has it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import butter, filtfilt

from friction_bayes.statespace.coloured_noise import burg, with_missing_drawn

LAGS = np.array([0.9, -0.4, 0.2])


def coloured(rng: np.random.Generator, samples: int) -> np.ndarray:
    """Noise of an autoregression of order three."""
    values = rng.standard_normal(samples + 200)
    for i in range(3, values.size):
        values[i] += LAGS @ values[i - 3 : i][::-1]
    return values[200:]


def test_white_noise_stays_white(rng: np.random.Generator) -> None:
    """Interpolated, every one of such records passes for coloured."""
    orders, variances = [], []
    for _ in range(30):
        noise = rng.standard_normal(1000)
        whole = with_missing_drawn(noise, rng.random(1000) > 0.3)
        colour, variance = burg(whole, 0.0)
        orders.append(colour.order)
        variances.append(variance)
    assert np.count_nonzero(orders) <= 2
    # thirty times a thousand samples: sd .008
    assert abs(np.mean(variances) - 1.0) < 0.035


def test_a_colour_is_kept(rng: np.random.Generator) -> None:
    noise = coloured(rng, 4000)
    for share in (0.02, 0.3):
        colour, _ = burg(with_missing_drawn(noise, rng.random(noise.size) > share), 0.0)
        whole, _ = burg(noise, 0.0)
        omega = np.linspace(0.05, 3.1, 200)
        assert np.max(np.abs(np.log(colour.spectrum(omega) / whole.spectrum(omega)))) < 0.6


@pytest.mark.parametrize("missing", ["first", "amid", "last", "scattered"])
def test_samples_are_drawn_from_their_conditional_distribution(
    missing: str, rng: np.random.Generator
) -> None:
    """Standardised by dense algebra they are the normal numbers that they are made of, turned."""
    n = 300
    place = {"first": np.arange(4), "amid": np.arange(60, 70), "last": np.arange(n - 4, n)}
    omega = np.linspace(0.0, np.pi, 4001)
    lags = np.arange(n)[:, None]
    for _ in range(5):
        noise = coloured(rng, n)
        gone = rng.random(n) < 0.15 if missing == "scattered" else np.isin(np.arange(n), place[missing])
        whole = with_missing_drawn(noise, ~gone)
        assert np.array_equal(whole[~gone], noise[~gone])
        colour, variance = burg(whole, 0.0)
        assert colour.order > 0
        spectrum = variance * colour.spectrum(omega)
        covariance = toeplitz(np.trapezoid(spectrum * np.cos(lags * omega), omega, axis=1) / np.pi)
        gain = covariance[np.ix_(gone, ~gone)] @ np.linalg.inv(covariance[np.ix_(~gone, ~gone)])
        left = whole - whole[~gone].mean()
        spread = covariance[np.ix_(gone, gone)] - gain @ covariance[np.ix_(~gone, gone)]
        z = np.linalg.solve(np.linalg.cholesky(spread), left[gone] - gain @ left[~gone])
        normal = np.random.default_rng(0).standard_normal(z.size)
        assert z @ z == pytest.approx(normal @ normal, rel=0.05)


def test_noise_behind_a_steep_filter_is_completed_within_its_bounds(rng: np.random.Generator) -> None:
    """Its autoregression is singular to rounding, and a long stretch is missing."""
    noise = filtfilt(*butter(4, 0.1), rng.standard_normal(2000))
    known = np.ones(noise.size, np.bool_)
    known[700:760] = known[-30:] = False
    whole = with_missing_drawn(noise, known)
    assert np.max(np.abs(whole)) < 1.5 * np.max(np.abs(noise))
    assert whole[710:750].std() > 0.3 * noise.std()


def test_a_residual_that_is_constant_or_missing_has_no_colour() -> None:
    known = np.arange(100) > 10
    assert np.array_equal(with_missing_drawn(np.full(100, 2.0), known), np.full(100, 2.0))
    assert np.array_equal(with_missing_drawn(np.ones(100), np.zeros(100, np.bool_)), np.zeros(100))


def test_nothing_else_decides_what_is_drawn(rng: np.random.Generator) -> None:
    noise, known = coloured(rng, 500), rng.random(500) > 0.1
    whole = with_missing_drawn(noise, known)
    assert np.array_equal(whole, with_missing_drawn(np.where(known, noise, 7.0), known))
    assert np.allclose(with_missing_drawn(-noise, known), -whole, rtol=0.0, atol=1e-12)
    assert np.allclose(with_missing_drawn(1e3 * noise, known), 1e3 * whole, rtol=1e-9)
    assert np.array_equal(with_missing_drawn(noise, np.ones(500, np.bool_)), noise)
