"""Oscillations in the spectrum of a record: the one that is followed, and whether there is another.

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
from numpy.typing import NDArray
from scipy.fft import rfft

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
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
_AT_A_TIME = 1 << 18
"""Values of spectra that are kept at a time, while they are near."""
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
    length = 1 << max(2 * n - 1, 8).bit_length()
    grid = np.arange(length // 2 + 1) * (2.0 * math.pi / length)
    low, high = max(expected / BAND, 2.0 * math.pi / n), min(2.0 * BAND * expected, math.pi)
    band = np.flatnonzero((grid >= low) & (grid <= high))
    sought = int(np.count_nonzero(grid[band] <= BAND * expected))
    if sought < 3:
        return alone
    first, grid = int(band[0]), grid[band]
    into_samples = 0.5 / np.sin(0.5 * grid)
    at_a_time = max(_AT_A_TIME // length, 1)
    for begin in range(0, rows, at_a_time):
        part = slice(begin, begin + at_a_time)
        own = SpectralModes._make(field[part] for field in alone)
        steps = np.empty((own.frequency.size, n - 1), np.float32)
        _fill_steps(values[part], width, steps)
        spectrum = rfft(steps, length, axis=1)
        peak, tops, longs, beyond = _strongest(spectrum, first, grid, into_samples, sought, own.frequency)
        for row in np.flatnonzero(beyond & (tops > 0.0)).tolist():
            amplitude = np.abs(spectrum[row, band].astype(np.complex128)) * into_samples / tops[row]
            _tell_others(own, row, amplitude, grid, int(peak[row]), longs[row], expected)
    for frequency in (alone.frequency, alone.other):
        frequency /= width
    return alone


def _tell_others(
    modes: SpectralModes,
    row: int,
    amplitude: Array,
    grid: Array,
    peak: int,
    long: float,
    expected: float,
) -> None:
    """Put what modes there are in addition to the strongest, whose amplitude is one, into a row."""
    found = _others(amplitude, grid, peak, long)
    if found.size:
        main, shares, at_others = grid[peak], amplitude[found], grid[found]
        in_band = at_others <= BAND * expected
        rivals = in_band & (shares >= _RIVAL)
        if abs(main / expected - 1.0) > _APART:
            rivals |= np.abs(at_others / expected - 1.0) < _APART
        if main > _TOO_FAST * expected:
            rivals |= (np.abs(at_others / main - 2.0) < 0.5 * _APART) & (shares >= _OVERTONE)
        ranked = np.lexsort((shares, rivals))
        modes.other[row], modes.share[row] = at_others[ranked[-1]], shares[ranked[-1]]
        modes.several[row] = rivals.any()


@njit(**KERNEL, fastmath={"contract"})
def _fill_steps(values: Array, width: int, steps: NDArray[np.float32]) -> None:
    """Differences of the means of blocks, shape (records, blocks - 1), over the root of the sum of squares of
    the means about theirs; samples that are not finite count as zero.
    """
    means = np.empty(steps.shape[1] + 1)
    for r in range(values.shape[0]):
        fill_block_means(values[r], width, 0.0, means)
        energy = _about_mean(means)
        if not math.isfinite(energy):
            finite = np.empty(values.shape[1])
            for i in range(finite.size):
                finite[i] = values[r, i] if math.isfinite(values[r, i]) else 0.0
            fill_block_means(finite, width, 0.0, means)
            energy = _about_mean(means)
        scale = 1.0 / math.sqrt(energy) if energy > 0.0 else 0.0
        for k in range(means.size - 1):
            steps[r, k] = (means[k + 1] - means[k]) * scale


@njit(**INNER, fastmath={"reassoc", "contract"})
def _about_mean(values: Array) -> float:
    """Sum of the squares about the mean, in any order."""
    total = square = 0.0
    for k in range(values.size):
        total += values[k]
    mean = total / values.size
    for k in range(values.size):
        square += (values[k] - mean) ** 2
    return square


@njit(**KERNEL)
def _strongest(
    spectrum: NDArray[np.complex64],
    first: int,
    grid: Array,
    into_samples: Array,
    sought: int,
    frequency: Array,
) -> tuple[Indices, Array, Array, Mask]:
    """Find the strongest maximum of each record, and whether any apart from it rises above its skirts.

    Rounding aside :func:`_others` finds none where none does.

    Parameters
    ----------
    spectrum : ndarray of complex, shape (records, m)
        Of the differences of a signal of unit energy, or of none.
    first : int
        Place of the first frequency of the band in it.
    grid, into_samples : ndarray, shape (k,)
        Frequencies of the band, and factors from amplitudes of differences to those of samples.
    sought : int
        So many of them are looked at for the strongest.
    frequency : ndarray, shape (records,)
        Receives its frequency.

    Returns
    -------
    peak : ndarray of int, shape (records,)
        Its place in the band.
    top, long : ndarray, shape (records,)
        Its amplitude, and for how many samples the decay lasts.
    beyond : ndarray of bool, shape (records,)
    """
    records = spectrum.shape[0]
    peak, beyond = np.zeros(records, np.intp), np.zeros(records, np.bool_)
    tops, longs = np.zeros(records), np.full(records, np.nan)
    power, amplitude = np.empty(grid.size), np.empty(grid.size)
    for r in range(records):
        own = spectrum[r, first : first + grid.size]
        for k in range(grid.size):
            power[k] = float(own[k].real) ** 2 + float(own[k].imag) ** 2
            amplitude[k] = math.sqrt(power[k]) * into_samples[k]
        best = 0
        for k in range(1, sought):
            best = k if power[k] > power[best] else best
        best = min(max(best, 1), sought - 2)
        before, at, after = power[best - 1], power[best], power[best + 1]
        bend, shift = before - 2.0 * at + after, 0.0
        if bend < 0.0:
            shift = min(max(0.5 * (before - after) / bend, -1.0), 1.0)
        top = amplitude[best]
        peak[r], tops[r] = best, top
        frequency[r] = grid[best] + shift * (grid[1] - grid[0])
        if top > 0.0:
            longs[r] = 2.0 * top * top
            beyond[r] = _beyond_skirts(amplitude, grid, best, longs[r])
    return peak, tops, longs, beyond


@njit(**INNER)
def _beyond_skirts(amplitude: Array, grid: Array, peak: int, long: float) -> bool:
    top, main = amplitude[peak], grid[peak]
    for k in range(1, amplitude.size - 1):
        own = amplitude[k]
        if own < _NEARLY * _LEAST_SHARE * top or own <= amplitude[k - 1] or own < amplitude[k + 1]:
            continue
        apart = abs(grid[k] - main)
        if apart > _APART * max(main, grid[k]):
            skirt = _SKIRT / (apart * long) * math.sqrt(max(1.0, main / grid[k]))
            if own > _NEARLY * skirt * top:
                return True
    return False


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
