"""Uneven times on an even grid, by a spline."""

from __future__ import annotations

import numpy as np

from friction_bayes.decay.even_grid import even_grid
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.clock import is_even

N, STEP = 400, 0.01
TIME = np.arange(N) * STEP
SIGNAL = 0.01 * np.cos(8.0 * TIME) * (1.0 - TIME / 5.0)


def test_a_spline_brings_the_signal_onto_an_even_grid(rng) -> None:
    time = TIME + 0.3 * STEP * rng.uniform(-1.0, 1.0, N)
    grid, even = even_grid(time, 0.01 * np.cos(8.0 * time), 8.0)
    assert is_even(grid)
    # cubic splines err by (h w)**4 * 5/384 of the amplitude, here h w = 0.13 at worst; ends are worse
    np.testing.assert_allclose(even, 0.01 * np.cos(8.0 * grid), atol=1e-6)


def test_a_spline_fills_a_lost_sample_and_keeps_the_others() -> None:
    keep = np.delete(np.arange(N), 100)
    grid, even = even_grid(TIME[keep], SIGNAL[keep], 8.0)
    np.testing.assert_allclose(grid, TIME, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(even, SIGNAL, atol=1e-7)


def test_over_a_gap_it_does_not_go_by_the_noise_of_two_samples(rng) -> None:
    """A cubic spline through both sides of this one is off by ten times the noise."""
    noisy = SIGNAL + 3e-4 * rng.normal(size=N)
    for first in range(20, N - 40, 20):
        keep = np.delete(np.arange(N), np.arange(first, first + 18))
        grid, even = even_grid(TIME[keep], noisy[keep], 8.3)
        np.testing.assert_allclose(grid, TIME, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(even[first : first + 18], SIGNAL[first : first + 18], atol=1e-3)


def test_an_even_grid_keeps_to_rounded_time_stamps() -> None:
    """A camera of 12 frames a second, its stamps in whole milliseconds: the grid is that of the frames."""
    frames = np.delete(np.arange(400), 100)
    stamps = np.round(frames / 12.0, 3)
    grid, _ = even_grid(stamps, 0.01 * np.cos(3.0 * stamps), 3.0)
    np.testing.assert_allclose(grid, np.arange(400) / 12.0, atol=1e-3)


def test_an_even_grid_keeps_flat_tops_flat(rng) -> None:
    time = TIME + 0.2 * STEP * rng.uniform(-1.0, 1.0, N)
    clipped = np.minimum(0.01 * np.cos(8.0 * time), 0.006)
    _, even = even_grid(time, clipped, 8.0)
    assert np.count_nonzero(even == 0.006) > 0.9 * np.count_nonzero(clipped == 0.006) - 20


def test_a_clipped_signal_is_seen_to_be_after_it(rng) -> None:
    time = np.arange(2000) / 100.0 + 0.002 * rng.uniform(-1.0, 1.0, 2000)
    clipped = np.clip(14.7 * np.cos(10.0 * time) * (1.0 - time / 30.0), -10.0, 10.0)
    assert clipped_fraction(even_grid(time, clipped, 10.0)[1])[0] > 0.1
