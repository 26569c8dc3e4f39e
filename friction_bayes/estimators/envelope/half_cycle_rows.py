r"""One number a half cycle that holds all a Coulomb decay says of its amplitude.

Given the phase ``theta(t)``, a sample is ``c + a f + u g``, see
:func:`friction_bayes.mechanics.coulomb.coulomb_shapes`. Within one half cycle that is a constant plus a
multiple of ``f`` alone: its amplitude is exhausted by the projection of the samples on ``f``, taken
orthogonal to ``df/dtheta`` so that an error of the local phase does not enter, and scaled to unit norm, so
that white noise of the signal becomes independent noise of the same variance. The design entries are the
exact projections of ``f``, ``g`` and 1 at whatever instants were sampled. No peak is picked, and nothing
telescopes.

What is left of the constant, orthogonal to both, is summed over the half cycles to one datum of the rest
position. Kept apart it would tell of friction about ``1/N^2`` of what ``N`` amplitudes tell, and it would mix
the slow noise of a drifting centre with that of the amplitudes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.decay.linear_least_squares import solve_spd
from friction_bayes.decay.phase_polynomial import phase_at
from friction_bayes.decay.phase_tracking import MAX_DEGREE, coulomb_fit, track_phase
from friction_bayes.mechanics.coulomb import coulomb_shapes
from friction_bayes.mechanics.pendulum import linear_amplitude, third_harmonic

__all__ = ["envelope_statistics", "half_cycle_rows", "least_squares"]

_MIN_SAMPLES = 6.0
_SMALLEST_SHARE = 1e-3


@njit(cache=True, nogil=True)
def half_cycle_rows(
    values: Array, polynomial: Array, order: int, swing_frequency: float
) -> tuple[Array, Array, int]:
    """Amplitude of every half cycle, and the rest position, as rows of a regression on ``(a, u, c)``.

    Where a half cycle holds fewer than 6 samples, blocks of several are projected together.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The moving samples.
    polynomial : ndarray, shape (k,)
        Phase of the signal, from :func:`friction_bayes.decay.phase_tracking.track_phase`.
    order : int
        Derivative order of the signal.
    swing_frequency : float
        Natural frequency of a pendulum [rad/s]; zero for a linear system. A pendulum's third harmonic is
        taken out, its amplitudes are replaced by those that friction lowers linearly, and incomplete half
        cycles are left out.

    Returns
    -------
    response : ndarray, shape (rows,)
        Amplitudes first, the rest position last.
    design : ndarray, shape (rows, 3)
        Columns: initial amplitude ``a``, friction coefficient ``u``, rest position ``c``.
    amplitudes : int
        How many half cycles (or blocks of them) gave an amplitude.
    """
    n = values.size
    shift = 0.5 * order * math.pi
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    per_half_cycle = math.pi * (n - 1) / (last - first)
    stride = math.ceil(_MIN_SAMPLES / per_half_cycle)
    first_block = math.floor((first - shift) / (math.pi * stride))
    blocks = math.floor((last - shift) / (math.pi * stride)) - first_block + 1
    # Sums of products of (slope, f, 1) with (slope, f, g, 1, y), one set a block.
    sums = np.zeros((blocks, 3, 5))
    basis = np.ones(5)
    amplitude, friction, third, previous_half = 0.0, 0.0, 0.0, 0
    if swing_frequency > 0.0:
        _, amplitude, friction = coulomb_fit(values, order, polynomial)
    for i in range(n):
        chi, _ = phase_at(polynomial, 2.0 * i / (n - 1) - 1.0)
        f, g, slope, half = coulomb_shapes(chi - shift, order)
        block = min(max(math.floor(half / stride) - first_block, 0), blocks - 1)
        basis[0], basis[1], basis[2], basis[4] = slope, f, g, values[i]
        if swing_frequency > 0.0:
            if i == 0 or half != previous_half:
                swing = amplitude - (2 * half + 1) * friction
                third = swing * third_harmonic(swing / swing_frequency**order, order)
                previous_half = half
            basis[4] -= third * math.cos(3.0 * chi)
        for b in range(5):
            sums[block, 0, b] += slope * basis[b]
            sums[block, 1, b] += f * basis[b]
            sums[block, 2, b] += basis[b]

    response = np.zeros(blocks + 1)
    design = np.zeros((blocks + 1, 3))
    rest = np.zeros(5)
    used = 0
    for block in range(blocks):
        s = sums[block]
        count = s[2, 3]
        whole = 0 < block < blocks - 1 or count > per_half_cycle * stride - 1.5
        if count < 2 or s[0, 0] <= _SMALLEST_SHARE * count or (swing_frequency > 0.0 and not whole):
            continue
        _remove(s, 1, 0, 0)
        _remove(s, 2, 0, 0)
        if s[1, 1] <= _SMALLEST_SHARE * count:
            continue
        _remove(s, 2, 1, 1)
        for b in range(5):
            rest[b] += s[2, b]
        _put(response, design, used, s[1], s[1, 1])
        used += 1
    rows = used
    if rest[3] > _SMALLEST_SHARE * n:
        _put(response, design, rows, rest, rest[3])
        rows += 1
    response = response[:rows].copy()
    design = design[:rows].copy()
    if swing_frequency > 0.0:
        _straighten(response, design, used, order, swing_frequency)
    return response, design, used


@njit(cache=True, nogil=True)
def _remove(sums: Array, row: int, other: int, column: int) -> None:
    """Make the function of one row orthogonal to that of another, which stands in ``column``."""
    share = sums[row, column] / sums[other, column]
    for b in range(5):
        sums[row, b] -= share * sums[other, b]


@njit(cache=True, nogil=True)
def _put(response: Array, design: Array, at: int, products: Array, square: float) -> None:
    """Enter one projection, scaled to unit norm."""
    norm = math.sqrt(square)
    for column in range(3):
        design[at, column] = products[1 + column] / norm
    response[at] = products[4] / norm


@njit(cache=True, nogil=True)
def _straighten(response: Array, design: Array, amplitudes: int, order: int, swing_frequency: float) -> None:
    """Replace a pendulum's Fourier amplitudes, in place, by ones linear in friction; same noise variance."""
    found, ok, _, _ = least_squares(design, response)
    centre = found[2] if ok else 0.0
    for i in range(amplitudes):
        norm, leak = design[i, 0], centre * design[i, 2]
        amplitude, slope = linear_amplitude((response[i] - leak) / norm, order, swing_frequency)
        response[i] = amplitude * norm / slope + leak
        design[i, 0] /= slope
        design[i, 1] /= slope


@njit(cache=True, nogil=True)
def least_squares(design: Array, response: Array) -> tuple[Array, bool, float, Array]:
    """Coefficients, whether they are determined, residual sum of squares, and the moment matrix ``X'X``."""
    rows, size = design.shape
    gram = np.zeros((size, size))
    right = np.zeros(size)
    for i in range(rows):
        for a in range(size):
            right[a] += design[i, a] * response[i]
            for b in range(size):
                gram[a, b] += design[i, a] * design[i, b]
    found, ok = solve_spd(gram, right)
    squares = 0.0
    for i in range(rows):
        residual = response[i]
        for a in range(size):
            residual -= design[i, a] * found[a]
        squares += residual * residual
    return found, ok, squares, gram


@njit(cache=True, nogil=True)
def envelope_statistics(
    records: Array,
    step: float,
    frequency: Array,
    phase: Array,
    start: Integers,
    stop: Integers,
    order: int,
    swing_frequency: float,
) -> tuple[Array, Array, Array, Integers, Array]:
    """Sufficient statistics of the envelope regression for many records at once.

    Parameters
    ----------
    records : ndarray, shape (r, n)
    step : float
        Sampling interval [s].
    frequency, phase : ndarray, shape (r,)
        Rough angular frequency [rad/s] and displacement phase of sample ``start`` [rad].
    start, stop : ndarray of int, shape (r,)
        The moving part, ``start <= i < stop``; an empty one marks a record to skip.
    order : int
        Derivative order of the signal.
    swing_frequency : float
        Natural frequency of a pendulum [rad/s], zero for a linear system.

    Returns
    -------
    gram : ndarray, shape (r, 3, 3)
        ``X'X`` over ``(a, u, c)``.
    coefficients : ndarray, shape (r, 3)
        Least-squares coefficients, NaN where they are not determined.
    residual : ndarray, shape (r,)
        Residual sum of squares.
    rows : ndarray of int, shape (r,)
        Data of the regression.
    polynomial : ndarray, shape (r, MAX_DEGREE + 1)
        Phase, from :func:`friction_bayes.decay.phase_tracking.track_phase`.
    """
    r = records.shape[0]
    gram = np.zeros((r, 3, 3))
    coefficients = np.full((r, 3), np.nan)
    residual = np.full(r, np.nan)
    rows = np.zeros(r, dtype=np.int64)
    polynomials = np.zeros((r, MAX_DEGREE + 1))
    for k in range(r):
        if stop[k] - start[k] < 8:
            continue
        values = records[k, start[k] : stop[k]]
        reference = values.mean()
        values = values - reference
        polynomial = track_phase(values, step, frequency[k], phase[k], order)
        response, design, _ = half_cycle_rows(values, polynomial, order, swing_frequency)
        found, ok, left, moments = least_squares(design, response)
        rows[k] = response.size
        for a in range(MAX_DEGREE + 1):
            polynomials[k, a] = polynomial[a]
        if ok:
            for a in range(3):
                coefficients[k, a] = found[a]
                for b in range(3):
                    gram[k, a, b] = moments[a, b]
            coefficients[k, 2] += reference
            residual[k] = left
    return gram, coefficients, residual, rows, polynomials
