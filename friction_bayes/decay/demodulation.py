"""Kernels that demodulate a free decay: complex amplitude in windows, phase as a polynomial of time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.linear_least_squares import add_sample, regression, solve_spd

__all__ = [
    "EVIDENCE",
    "Windows",
    "amplitudes",
    "demodulate",
    "fill_moments",
    "fill_turns",
    "largest",
    "phase_of",
    "rate_of",
    "rough_phase",
]

EVIDENCE = 30.0
"""Fall in chi-square that a description with more freedom must bring; successive windows overlap by half."""

_LEAST_WINDOW = 7
"""A window of one period is lengthened to hold at least this many samples."""


@njit(**INNER)
def amplitudes(inphase: Array, quadrature: Array) -> Array:
    """Amplitudes of windows, shape (windows,), see :func:`demodulate`."""
    amplitude = np.zeros(inphase.size)
    for k in range(inphase.size):
        amplitude[k] = math.hypot(inphase[k], quadrature[k])
    return amplitude


@njit(**INNER)
def largest(values: Array) -> float:
    """Largest value; minus infinity of none."""
    found = -math.inf
    for k in range(values.size):
        found = max(found, values[k])
    return found


class Windows(NamedTuple):
    """Complex amplitudes of windows, shape (windows,) each.

    Attributes
    ----------
    centre : ndarray
        Window centres [samples].
    inphase, quadrature : ndarray
        ``y ~ const + inphase cos(omega i) - quadrature sin(omega i)``, ``i`` counted from the record's start.
    noise : ndarray
        Standard deviation of either from the residual of the window.
    """

    centre: Array
    inphase: Array
    quadrature: Array
    noise: Array


@njit(**KERNEL)
def demodulate(y: Array, omega: float) -> Windows:
    """Complex amplitude of windows of one period, half a period apart, by least squares with a constant."""
    period = 2.0 * math.pi / omega
    length = round(max(period, float(_LEAST_WINDOW)))
    windows = int((y.size - length) / (0.5 * period)) + 1 if y.size >= length else 0
    centre, noise = np.zeros(windows), np.zeros(windows)
    inphase, quadrature = np.zeros(windows), np.zeros(windows)
    # about its first sample every window has the same design
    window = _window(omega, length)
    for w in range(windows):
        first = round(0.5 * period * w)
        if first + length > y.size:
            window = _window(omega, y.size - first)
        count = window.cosine.size
        centre[w] = 0.5 * (2 * first + count - 1)
        if window.regular:
            one, c, s, square = _products(y[first : first + count], window.cosine, window.sine)
            inverse = window.inverse
            constant = inverse[0, 0] * one + inverse[0, 1] * c + inverse[0, 2] * s
            along = inverse[1, 0] * one + inverse[1, 1] * c + inverse[1, 2] * s
            across = inverse[2, 0] * one + inverse[2, 1] * c + inverse[2, 2] * s
            rest = max(square - constant * one - along * c - across * s, 0.0)
            turned, turned_across = math.cos(omega * first), math.sin(omega * first)
            inphase[w] = along * turned - across * turned_across
            quadrature[w] = -along * turned_across - across * turned
            noise[w] = math.sqrt(2.0 * rest / max(length - 3, 1) / length)
    return Windows(centre, inphase, quadrature, noise)


@njit(**INNER)
def fill_turns(first: float, angle: float, cosine: Array, sine: Array) -> None:
    """Fill in the cosines and sines of a first angle and of those that follow it, each by one angle.

    By doubling, which rounds as often as the number of them has digits.
    """
    cosine[0], sine[0] = math.cos(first), math.sin(first)
    c, s = math.cos(angle), math.sin(angle)
    known, count = 1, cosine.size
    while known < count:
        # slices, so that compilers take several at a time
        before, across = cosine[:known], sine[:known]
        after, across_after = cosine[known : 2 * known], sine[known : 2 * known]
        for j in range(after.size):
            after[j] = before[j] * c - across[j] * s
            across_after[j] = across[j] * c + before[j] * s
        # twice the angle, of length one
        c, s = c * c - s * s, 2.0 * c * s
        kept = 1.5 - 0.5 * (c * c + s * s)
        c, s = kept * c, kept * s
        known *= 2


class _Window(NamedTuple):
    """Design of a window about its first sample: cosine and sine, and the inverse of its moments."""

    cosine: Array
    sine: Array
    inverse: Array
    regular: bool


@njit(**INNER)
def _window(omega: float, count: int) -> _Window:
    cosine, sine, inverse = np.empty(count), np.empty(count), np.empty((3, 3))
    matrix, right = np.empty((3, 3)), np.empty(3)
    fill_turns(0.0, omega, cosine, sine)
    fill_moments(cosine, cosine, sine, matrix, right)
    regular = True
    for k in range(3):
        for j in range(3):
            right[j] = 1.0 if j == k else 0.0
        column, ok = solve_spd(matrix, right)
        regular = regular and ok
        for j in range(3):
            inverse[j, k] = column[j]
    return _Window(cosine, sine, inverse, regular)


@njit(**INNER, fastmath={"reassoc", "contract"})
def fill_moments(y: Array, cosine: Array, sine: Array, matrix: Array, right: Array) -> float:
    """Fill in the moments of columns ``1, c, s``, several samples at a time; return the sum of squares."""
    one_c = one_s = cc = cs = ss = one_y = c_y = s_y = square = 0.0
    for i in range(y.size):
        c, s, value = cosine[i], sine[i], y[i]
        one_c, one_s = one_c + c, one_s + s
        cc, cs, ss = cc + c * c, cs + c * s, ss + s * s
        one_y, c_y, s_y, square = one_y + value, c_y + c * value, s_y + s * value, square + value * value
    matrix[0, 0], right[0] = y.size, one_y
    matrix[1, 0], matrix[1, 1], right[1] = one_c, cc, c_y
    matrix[2, 0], matrix[2, 1], matrix[2, 2], right[2] = one_s, cs, ss, s_y
    return square


@njit(**INNER, fastmath={"reassoc", "contract"})
def _products(y: Array, cosine: Array, sine: Array) -> tuple[float, float, float, float]:
    """Sums of ``y, y c, y s, y y``, taken several at a time."""
    one = c = s = square = 0.0
    for j in range(y.size):
        one += y[j]
        c += y[j] * cosine[j]
        s += y[j] * sine[j]
        square += y[j] * y[j]
    return one, c, s, square


@njit(**INNER)
def rough_phase(
    centre: Array, inphase: Array, quadrature: Array, floor: float, first: int, omega: float
) -> tuple[Array, float, float]:
    """Phase of the signal in time: a line, or a cubic where the data ask for it.

    Weights of windows are their squared amplitudes.

    Returns
    -------
    coefficients : ndarray, shape (4,)
        In powers of ``i / scale``.
    scale : float
        In samples.
    wander : float
        Mean square of what the polynomial leaves of the phase [rad2]; infinite when no window shows any.
    """
    used, square = 0, 0.0
    scale = max(centre[-1], 1.0)
    matrix, right, basis = np.zeros((4, 4)), np.zeros(4), np.ones(4)
    previous, previous_at, rate = 0.0, -1.0, 0.0
    for w in range(first, centre.size):
        power = inphase[w] ** 2 + quadrature[w] ** 2
        if not power > 16.0 * floor * floor:
            continue
        phase = math.atan2(quadrature[w], inphase[w])
        if previous_at >= 0.0:
            predicted = previous + rate * (centre[w] - previous_at)
            phase -= 2.0 * math.pi * round((phase - predicted) / (2.0 * math.pi))
            if used > 2:
                rate += 0.3 * ((phase - previous) / (centre[w] - previous_at) - rate)
        previous, previous_at = phase, centre[w]
        used += 1
        for k in range(1, 4):
            basis[k] = basis[k - 1] * centre[w] / scale
        add_sample(matrix, right, basis, phase, power)
        square += power * phase * phase
    result = np.zeros(4)
    left = math.inf
    size = min(2, used)
    if size > 0:
        corner, edge = np.zeros((size, size)), np.zeros(size)
        for a in range(size):
            edge[a] = right[a]
            for b in range(size):
                corner[a, b] = matrix[a, b]
        line, straight = regression(corner, edge, square)
        if straight < math.inf:
            left = straight
            for k in range(size):
                result[k] = line[k]
        if used >= 12:
            cubic, bent = regression(matrix, right, square)
            if straight - bent > EVIDENCE * floor * floor:
                left = bent
                for k in range(4):
                    result[k] = cubic[k]
    result[1] += omega * scale
    return result, scale, left / matrix[0, 0] if used > 0 else math.inf


@njit(**INNER)
def phase_of(polynomial: Array, scale: float, i: float) -> float:
    """Phase [rad] at sample ``i`` of a cubic in ``i / scale``, coefficients from the constant up."""
    s = i / scale
    return polynomial[0] + s * (polynomial[1] + s * (polynomial[2] + s * polynomial[3]))


@njit(**INNER)
def rate_of(polynomial: Array, scale: float, i: float) -> float:
    """Derivative of :func:`phase_of` [rad a sample]."""
    s = i / scale
    return (polynomial[1] + s * (2.0 * polynomial[2] + 3.0 * s * polynomial[3])) / scale
