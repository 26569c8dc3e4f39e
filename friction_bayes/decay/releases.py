"""Releases in a recording: where the amplitude of its oscillation rises at once, and the parts between.

A release takes the amplitude from less than half to its height within two periods, and since the one before
what moves has been at rest or held for as long. What rises more slowly, or never rests, is a beat, a line of
interference, or driven. Which of the parts is a free decay is not judged here: a hand that takes hold of what
rests raises the amplitude too.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import ZERO, Array, Integers
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import block_means
from friction_bayes.decay.demodulation import demodulate, largest

__all__ = ["parts_between_releases", "peaks_after_releases", "samples_averaged"]

_BLOCKS_PER_PERIOD = 48.0
"""Faster sampling than this is averaged in blocks, which costs 0.1 % of the amplitude and saves the time."""
_LEAST_SHARE = 0.1
"""Of the largest amplitude in the recording, that a release reaches."""
_OUT_OF_NOISE = 6.0
"""Times the noise of an amplitude, that a rise or a departure from rest exceeds."""
_LOW, _HIGH = 0.5, 0.8
"""Shares of the amplitude reached, from which and to which it rises at once."""
_AT_ONCE = 4
"""Windows, half a period apart, within which it does."""
_STILL = 0.1
"""Share of the amplitude reached, below which what is released later rests."""
_STILL_IN_NOISE = 3.0
"""Times the noise of an amplitude, that it may have too."""
_AT_REST = 3
"""Windows, half a period apart, that it rests for."""
_MOVED = 0.1
"""Share of a decay's amplitude by which its rest position moves where a hand takes hold."""


@njit(**KERNEL)
def samples_averaged(omega: float) -> int:
    """How many samples are averaged into one to look for the motion, ``omega`` in rad/sample."""
    return max(int(2.0 * math.pi / omega / _BLOCKS_PER_PERIOD), 1)


@njit(**KERNEL)
def peaks_after_releases(amplitude: Array, floor: float) -> Integers:
    """Windows in which the amplitude is largest after each release; a record may begin in motion.

    Parameters
    ----------
    amplitude : ndarray, shape (windows,)
        In windows of one period, half a period apart.
    floor : float
        Its noise.
    """
    peaks, count = np.zeros(amplitude.size, np.int64), 0
    least = max(_LEAST_SHARE * largest(amplitude), _OUT_OF_NOISE * floor)
    top, falling, low = ZERO, True, 0.0
    for w in range(amplitude.size + 1):
        # beyond the end it has fallen
        value = amplitude[w] if w < amplitude.size else 0.0
        if falling:
            low = min(low, value)
            if value >= least and _LOW * value >= low:
                top, falling = w, False
        elif value > amplitude[top]:
            top = w
        elif value <= _LOW * amplitude[top]:
            if _rises_at_once(amplitude, top):
                if count == 0 or _rests(amplitude, peaks[count - 1], top, _STILL_IN_NOISE * floor):
                    peaks[count] = top
                    count += 1
                elif amplitude[top] > amplitude[peaks[count - 1]]:
                    # the one before was a hand that went to the release
                    peaks[count - 1] = top
            falling, low = True, value
    return peaks[:count]


@njit(**INNER)
def _rises_at_once(amplitude: Array, top: int) -> bool:
    """Whether the amplitude reaches its height in window ``top`` fast, or had it as the record began."""
    low = top
    while low >= 0 and amplitude[low] > _LOW * amplitude[top]:
        low -= 1
    high = low + 1
    while amplitude[high] < _HIGH * amplitude[top]:
        high += 1
    return high - low <= _AT_ONCE


@njit(**INNER)
def _rests(amplitude: Array, after: int, top: int, noise: float) -> bool:
    """Whether what reaches its height in window ``top`` was at rest between window ``after`` and then."""
    run = 0
    for w in range(after + 1, top):
        run = run + 1 if amplitude[w] <= max(_STILL * amplitude[top], noise) else 0
        if run == _AT_REST:
            return True
    return False


def parts_between_releases(values: Array, omega: float) -> list[slice]:
    """Part a recording at its releases.

    Each part begins in the period before a release and ends before a hand moves what has come to rest, before
    the amplitude rises again, or with the recording.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples.
    omega : float
        Rough angular frequency [rad/sample].

    Returns
    -------
    list of slice
        In order, without overlap.
    """
    width = samples_averaged(omega)
    means = block_means(values - 0.5 * (values.min() + values.max()), width)
    centre, inphase, quadrature, noise = demodulate(means, omega * width)
    if not centre.size:
        return [slice(0, values.size)]
    amplitude, floor = np.hypot(inphase, quadrature), float(np.median(noise))
    peaks = peaks_after_releases(amplitude, floor).tolist()
    half = math.pi / (omega * width)
    middle = np.array([means[max(round(c - half), 0) : round(c + half) + 1].mean() for c in centre])
    begins = [_begin(amplitude, peak) for peak in peaks]
    parts = []
    for k, peak in enumerate(peaks):
        begin = 0.0 if begins[k] < 0 else centre[begins[k]] - half
        end = float(means.size)
        departed = _departure(amplitude, middle, floor, peak)
        if departed < centre.size:
            end = centre[departed] - 0.5 * half
        if k + 1 < len(peaks):
            end = min(end, centre[begins[k + 1]] - half)
        first = max(round(begin * width), 0)
        last = values.size if end >= means.size else round(end * width)
        parts.append(slice(first, max(last, first)))
    return parts


def _begin(amplitude: Array, peak: int) -> int:
    """Last window before a peak in which the amplitude is low; -1 where the record begins in motion."""
    low = np.flatnonzero(amplitude[:peak] <= _LOW * amplitude[peak])
    return int(low[-1]) if low.size else -1


def _departure(amplitude: Array, middle: Array, floor: float, peak: int) -> int:
    """First window after a peak in which the amplitude rises, or the middle moves away from where it was."""
    # windows up to the next after the peak may still hold what was before the release
    first = peak + 2
    low, moved = math.inf, _MOVED * amplitude[peak] + _OUT_OF_NOISE * floor
    for w in range(first, amplitude.size):
        low = min(low, float(amplitude[w]))
        if amplitude[w] > low / _LOW + _OUT_OF_NOISE * floor:
            return w
        if abs(middle[w] - np.median(middle[first : w + 1])) > moved:
            return w
    return amplitude.size
