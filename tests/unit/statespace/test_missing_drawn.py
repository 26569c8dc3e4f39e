"""What is missing of a residual is drawn from the noise of the rest, as exactly as dense algebra has it."""

from __future__ import annotations

import numpy as np
from scipy.linalg import toeplitz
from scipy.signal import butter, filtfilt

from friction_bayes.statespace.coloured_noise import Autoregression, burg, with_missing_drawn

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


def test_samples_are_drawn_from_their_conditional_distribution(rng: np.random.Generator) -> None:
    """Mean and covariance of many records that differ in nothing but what is missing from them."""
    noise = coloured(rng, 3000)
    known = rng.random(noise.size) > 0.2
    whole = with_missing_drawn(noise, known)
    assert np.array_equal(whole[known], noise[known])
    colour, variance = burg(whole, 0.0)
    # within a stretch around some missing samples, from the stationary covariance
    part = slice(1000, 1120)
    omega = np.linspace(0.0, np.pi, 20001)
    spectrum = Autoregression(colour.coefficients, colour.innovation_variance).spectrum(omega)
    lags = np.arange(120)[:, None]
    covariance = toeplitz(variance * np.trapezoid(spectrum * np.cos(lags * omega), omega, axis=1) / np.pi)
    used, gone = known[part], ~known[part]
    gain = covariance[np.ix_(gone, used)] @ np.linalg.inv(covariance[np.ix_(used, used)])
    left = (whole - whole[known].mean())[part]
    spread = covariance[np.ix_(gone, gone)] - gain @ covariance[np.ix_(used, gone)]
    z = np.linalg.solve(np.linalg.cholesky(spread), left[gone] - gain @ left[used])
    # false alarm 1e-4
    assert abs(z @ z - z.size) < 4.0 * np.sqrt(2.0 * z.size)


def test_noise_behind_a_steep_filter_is_completed_within_its_bounds(rng: np.random.Generator) -> None:
    """Its autoregression is singular to rounding, and a long stretch is missing."""
    noise = filtfilt(*butter(4, 0.1), rng.standard_normal(2000))
    known = np.ones(noise.size, np.bool_)
    known[700:760] = known[-30:] = False
    whole = with_missing_drawn(noise, known)
    assert np.max(np.abs(whole)) < 1.5 * np.max(np.abs(noise))


def test_nothing_else_decides_what_is_drawn(rng: np.random.Generator) -> None:
    noise, known = coloured(rng, 500), rng.random(500) > 0.1
    whole = with_missing_drawn(noise, known)
    assert np.array_equal(whole, with_missing_drawn(np.where(known, noise, 7.0), known))
    assert np.allclose(with_missing_drawn(-noise, known), -whole, rtol=0.0, atol=1e-12)
    assert np.allclose(with_missing_drawn(1e3 * noise, known), 1e3 * whole, rtol=1e-9)
    assert np.array_equal(with_missing_drawn(noise, np.ones(500, np.bool_)), noise)
