"""Oscillations in the spectrum of a record: the one that is followed, and whether another is there besides.

A decay that begins at once has skirts that fall off as one over the distance in frequency, times the length
of the decay; another mode must rise above them. It must also be separate, with a dip before it, which
the sweep of a spring that stiffens or of a pendulum has not.

The spectrum is that of the differences of the samples, brought back to the samples themselves: the signal
itself begins with a step, from nothing to where it is held, and a hold of a second makes lobes of that.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.kernels import KERNEL
from friction_bayes.decay.block_means import fill_block_means

__all__ = ["BAND", "SpectralModes", "spectral_modes"]

BAND = 3.0
"""The frequency is sought within this factor of the declared natural frequency."""
_SAMPLES_PER_PERIOD = 8.0
"""Of the fastest oscillation looked for; faster sampling is averaged first."""
_APART = 0.2
"""Least distance of two modes over the frequency of either: what is nearer shows as a beat."""
_SKIRT = 6.0
"""Share of the strongest mode that its skirts hold, times distance and length: three times the largest."""
_LEAST_SHARE = 0.05
"""Of the strongest mode's amplitude, that another one has."""
_DIP = 0.5
"""Share of the weaker mode's amplitude below which the spectrum falls between two."""
_RIVAL = 0.5
"""Share of the strongest mode from which on the record is not that of one mode."""
_NEARLY = 1.0 - 1e-9
"""Share of a limit that rounding in another order does not reach."""
_OVERTONE = 0.1
"""Share of its double frequency in a signal without sign, which has a fifth; half a free decay's has less."""
_TOO_FAST = 1.5
"""Times the declared frequency, from which on such a signal is taken for the cause."""


class SpectralModes(NamedTuple):
    """Modes of many records.

    Attributes
    ----------
    frequency : ndarray, shape (records,)
        Of the strongest [rad/sample].
    other : ndarray, shape (records,)
        Of the next that there is for certain [rad/sample]; nan where there is none.
    share : ndarray, shape (records,)
        Its amplitude over that of the strongest.
    several : ndarray of bool, shape (records,)
        Whether the record is not that of one mode near the declared frequency.
    """

    frequency: Array
    other: Array
    share: Array
    several: Mask


def spectral_modes(values: Array, expected: float) -> SpectralModes:
    """Find the strongest spectral maximum near ``expected`` [rad/sample], and another, in each row."""
    rows, nothing = values.shape[0], np.full(values.shape[0], np.nan)
    alone = SpectralModes(np.full(rows, expected), nothing, nothing.copy(), np.zeros(rows, dtype=np.bool_))
    width = max(int(2.0 * math.pi / (BAND * expected * _SAMPLES_PER_PERIOD)), 1)
    n = values.shape[1] // width
    if n < 4:
        return alone
    expected = expected * width
    clean = np.empty((rows, n))
    _fill_means(values, width, clean)
    clean -= clean.mean(axis=1, keepdims=True)
    length = 1 << max(2 * n - 1, 8).bit_length()
    grid = np.arange(length // 2 + 1) * (2.0 * math.pi / length)
    low, high = max(expected / BAND, 2.0 * math.pi / n), min(2.0 * BAND * expected, math.pi)
    band = np.flatnonzero((grid >= low) & (grid <= high))
    sought = np.count_nonzero(grid[band] <= BAND * expected)
    if sought < 3:
        return alone
    slope = np.abs(np.fft.rfft(np.diff(clean, axis=1), length, axis=1)[:, band])
    power, amplitude = slope**2, slope / (2.0 * np.sin(0.5 * grid[band]))
    peak = np.clip(power[:, :sought].argmax(axis=1), 1, sought - 2)
    every = np.arange(rows)
    before, at, after = (power[every, peak + k] for k in (-1, 0, 1))
    bend = before - 2.0 * at + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
    alone.frequency[:] = (grid[band[peak]] + np.clip(shift, -1.0, 1.0) * grid[1]) / width
    energy = np.sum(clean**2, axis=1)
    tops = amplitude[every, peak]
    with np.errstate(invalid="ignore", divide="ignore"):
        longs = 2.0 * tops**2 / energy
    beyond = _beyond_skirts(amplitude, grid[band], peak, longs)
    for row in np.flatnonzero(beyond & (tops > 0.0)).tolist():
        main, top, long = grid[band[peak[row]]], tops[row], longs[row]
        found = _others(amplitude[row] / top, grid[band], int(peak[row]), long)
        if found.size:
            shares, at_others = amplitude[row, found] / top, grid[band[found]]
            in_band = at_others <= BAND * expected
            rivals = in_band & (shares >= _RIVAL)
            if abs(main / expected - 1.0) > _APART:
                rivals |= np.abs(at_others / expected - 1.0) < _APART
            if main > _TOO_FAST * expected:
                rivals |= (np.abs(at_others / main - 2.0) < 0.5 * _APART) & (shares >= _OVERTONE)
            ranked = np.lexsort((shares, rivals))
            alone.other[row], alone.share[row] = at_others[ranked[-1]] / width, shares[ranked[-1]]
            alone.several[row] = rivals.any()
    return alone


@njit(**KERNEL)
def _fill_means(values: Array, width: int, means: Array) -> None:
    """Means of blocks; samples that are not finite count as zero."""
    for r in range(values.shape[0]):
        fill_block_means(values[r], width, 0.0, means[r])
        total = 0.0
        for k in range(means.shape[1]):
            total += means[r, k]
        if not math.isfinite(total):
            finite = np.where(np.isfinite(values[r]), values[r], 0.0)
            fill_block_means(finite, width, 0.0, means[r])


@njit(**KERNEL)
def _beyond_skirts(amplitude: Array, grid: Array, peak: Indices, long: Array) -> Mask:
    """Whether any maximum apart from the strongest rises above its skirts, shape (records,).

    Rounding aside :func:`_others` finds none where not.
    """
    found = np.zeros(amplitude.shape[0], np.bool_)
    for r in range(amplitude.shape[0]):
        own, main = amplitude[r], grid[peak[r]]
        top = own[peak[r]]
        for k in range(1, own.size - 1):
            if own[k] < _NEARLY * _LEAST_SHARE * top or own[k] <= own[k - 1] or own[k] < own[k + 1]:
                continue
            apart = abs(grid[k] - main)
            if apart > _APART * max(main, grid[k]):
                skirt = _SKIRT / (apart * long[r]) * math.sqrt(max(1.0, main / grid[k]))
                found[r] |= own[k] > _NEARLY * skirt * top
    return found


def _others(amplitude: Array, grid: Array, main: int, long: float) -> Array:
    """Where the modes other than ``main`` are, amplitudes being over its own; ``long`` samples of decay."""
    apart = np.abs(grid - grid[main])
    skirt = _SKIRT / (np.maximum(apart, grid[1] - grid[0]) * long)
    # a record that ends in mid-swing has more of it below, by up to the ratio of the frequencies
    least = np.maximum(_LEAST_SHARE, skirt * np.sqrt(np.maximum(1.0, grid[main] / grid)))
    inner = amplitude[1:-1]
    tops = 1 + np.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]) & (inner > least[1:-1]))
    tops = tops[apart[tops] > _APART * np.maximum(grid[main], grid[tops])]
    alone = [
        amplitude[min(main, top) : max(main, top) + 1].min() < _DIP * amplitude[top] for top in tops.tolist()
    ]
    return np.asarray(tops[alone])
