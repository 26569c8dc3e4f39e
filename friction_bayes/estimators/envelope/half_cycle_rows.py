r"""One number a half cycle, a sufficient statistic of its amplitude in a Coulomb decay.

Given the phase ``theta(t)``, a sample is ``c + a f + u g``, see
:func:`friction_bayes.mechanics.coulomb.coulomb_shapes`. Within one half cycle that is a constant plus a
multiple of ``f`` alone: its amplitude is exhausted by the projection of the samples on ``f``, taken
orthogonal to ``df/dtheta`` so that an error of the local phase does not enter, and scaled to unit norm, so
that white noise of the signal becomes independent noise of the same variance. The design entries are the
exact projections of ``f``, ``g`` and 1 at whatever instants were sampled. No peak is picked, and nothing
telescopes.

The remainder of the constant, orthogonal to both, is summed over the half cycles to one datum of the rest
position. Kept per half cycle it would add about ``1/N^2`` of the information of ``N`` amplitudes on friction,
and mix the slow noise of a drifting centre with that of the amplitudes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array, Integers
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import about_mean
from friction_bayes.decay.linear_least_squares import add_sample, solve_spd
from friction_bayes.decay.phase_polynomial import phase_at
from friction_bayes.decay.phase_tracking import (
    COS,
    LATER_COS,
    MAX_DEGREE,
    ONE,
    SIN,
    UNDAMPED,
    coulomb_fit,
    half_cycle_moments,
    track_phase,
)
from friction_bayes.mechanics.pendulum import linear_amplitude, third_harmonic

__all__ = ["EnvelopeStatistics", "envelope_statistics", "half_cycle_rows", "least_squares"]

_SLOPE, _F, _G, _CONSTANT, _PLACE, _SIGNAL = range(6)
"""Functions of a half cycle: ``df/dtheta``, ``f``, ``g``, 1, the position times ``f``, and the samples."""
_FUNCTIONS = 6
_A, _U, _C = range(3)
"""Columns of the regression: initial amplitude, friction coefficient, rest position."""

_ALL, _COMPLETE_ALONE = np.False_, np.True_
"""Which half cycles are taken: for a literal numba would compile their rows once more."""

_MIN_SAMPLES = 6.0
_SMALLEST_SHARE = 1e-3


def half_cycle_rows(
    values: Array, polynomial: Array, order: int, swing_frequency: float
) -> tuple[Array, Array, Array]:
    """Amplitude of every half cycle, and the rest position, as rows of a regression on ``(a, u, c)``.

    Where a half cycle has fewer than 6 samples, blocks of several are projected together.

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
    place : ndarray, shape (amplitudes,)
        Position in [-1, 1] to which each amplitude belongs where it changes within its half cycle (or block
        of them), as dry friction alone does not make it.
    """
    # what a pendulum takes in addition need not be compiled for others
    if swing_frequency > 0.0:
        return _rows_of_pendulum(values, polynomial, order, swing_frequency)
    return _rows(values, polynomial, order, _ALL)


@njit(**KERNEL)
def _rows_of_pendulum(
    values: Array, polynomial: Array, order: int, swing_frequency: float
) -> tuple[Array, Array, Array]:
    swing = _without_third_harmonic(values, polynomial, order, swing_frequency)
    response, design, place = _rows(swing, polynomial, order, _COMPLETE_ALONE)
    _straighten(response, design, place.size, order, swing_frequency)
    return response, design, place


@njit(**KERNEL)
def _rows(values: Array, polynomial: Array, order: int, complete_alone: bool) -> tuple[Array, Array, Array]:
    """Rows of an oscillation without harmonics, of ``complete_alone`` half cycles or of all."""
    n = values.size
    shift = 0.5 * order * math.pi
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    per_half_cycle = math.pi * (n - 1) / (last - first)
    stride = math.ceil(_MIN_SAMPLES / per_half_cycle)
    first_block = math.floor((first - shift) / (math.pi * stride))
    blocks = math.floor((last - shift) / (math.pi * stride)) - first_block + 1
    with_slope, with_f, with_one = _products(values, polynomial, order, stride, first_block, blocks)
    response = np.zeros(blocks + 1)
    design, place = np.zeros((blocks + 1, 3)), np.zeros(blocks)
    rest = np.zeros(_FUNCTIONS)
    used = ZERO
    for block in range(blocks):
        slope_products, f_products, one_products = with_slope[block], with_f[block], with_one[block]
        count = one_products[_CONSTANT]
        whole = 0 < block < blocks - 1 or count > per_half_cycle * stride - 1.5
        flat = slope_products[_SLOPE] <= _SMALLEST_SHARE * count
        if count >= 2 and not flat and (whole or not complete_alone):
            _remove(f_products, slope_products, _SLOPE)
            _remove(one_products, slope_products, _SLOPE)
            if f_products[_F] > _SMALLEST_SHARE * count:
                _remove(one_products, f_products, _F)
                for b in range(_FUNCTIONS):
                    rest[b] += one_products[b]
                _put(response, design, used, f_products, f_products[_F])
                place[used] = f_products[_PLACE] / f_products[_F]
                used += 1
    rows = used
    if rest[_CONSTANT] > _SMALLEST_SHARE * n:
        _put(response, design, rows, rest, rest[_CONSTANT])
        rows += 1
    return response[:rows].copy(), design[:rows].copy(), place[:used].copy()


@njit(**INNER)
def _products(
    values: Array,
    polynomial: Array,
    order: int,
    stride: int,
    first_block: int,
    blocks: int,
) -> tuple[Array, Array, Array]:
    """Inner products of slope, ``f`` and 1 over each block with every function, (blocks, functions) each.

    A block is ``stride`` half cycles long.
    """
    with_slope, with_f, with_one = (
        np.zeros((blocks, _FUNCTIONS)),
        np.zeros((blocks, _FUNCTIONS)),
        np.zeros((blocks, _FUNCTIONS)),
    )
    cycles = half_cycle_moments(values, -1.0, 2.0 / (values.size - 1), order, polynomial)
    for k in range(cycles.number.size):
        half, moments, right, middle = cycles.number[k], cycles.matrix[k], cycles.right[k], cycles.place[k]
        block = min(max(math.floor(half / stride) - first_block, 0), blocks - 1)
        sign = 0.0
        if order == 0:
            sign = 1.0 if half % 2 == 0 else -1.0
        # of 1, cos and sin, of which the last is minus the slope
        for row, turn, products in (
            (SIN, -1.0, with_slope[block]),
            (COS, 1.0, with_f[block]),
            (ONE, 1.0, with_one[block]),
        ):
            one, cosine, sine = moments[row, ONE], moments[row, COS], moments[row, SIN]
            products[_SLOPE] -= turn * sine
            products[_F] += turn * cosine
            products[_G] += turn * (sign * one - (2 * half + 1) * cosine)
            products[_CONSTANT] += turn * one
            products[_PLACE] += turn * (moments[LATER_COS, row] + middle * cosine)
            products[_SIGNAL] += turn * right[row]
    return with_slope, with_f, with_one


@njit(**INNER)
def _without_third_harmonic(values: Array, polynomial: Array, order: int, swing_frequency: float) -> Array:
    """Samples of a pendulum less the third harmonic of its swing."""
    n, shift = values.size, 0.5 * order * math.pi
    _, amplitude, friction = coulomb_fit(values, order, polynomial)
    without = np.empty(n)
    third, previous_half = 0.0, 0
    for i in range(n):
        chi, _ = phase_at(polynomial, 2.0 * i / (n - 1) - 1.0)
        half = math.floor((chi - shift) / math.pi)
        if i == 0 or half != previous_half:
            swing = amplitude - (2 * half + 1) * friction
            third = swing * third_harmonic(swing / swing_frequency**order, order)
            previous_half = half
        without[i] = values[i] - third * math.cos(3.0 * chi)
    return without


@njit(**INNER)
def _remove(products: Array, others: Array, other: int) -> None:
    """Make one function orthogonal to another, given the inner products of each with all functions."""
    share = products[other] / others[other]
    for b in range(_FUNCTIONS):
        products[b] -= share * others[b]


@njit(**INNER)
def _put(response: Array, design: Array, at: int, products: Array, square: float) -> None:
    """Enter one projection, scaled to unit norm."""
    norm = math.sqrt(square)
    design[at, _A] = products[_F] / norm
    design[at, _U] = products[_G] / norm
    design[at, _C] = products[_CONSTANT] / norm
    response[at] = products[_SIGNAL] / norm


@njit(**INNER)
def _straighten(response: Array, design: Array, amplitudes: int, order: int, swing_frequency: float) -> None:
    """Replace a pendulum's Fourier amplitudes, in place, by ones linear in friction; same noise variance."""
    found, ok, _, _ = least_squares(design, response)
    centre = found[_C] if ok else 0.0
    for i in range(amplitudes):
        norm, leak = design[i, _A], centre * design[i, _C]
        amplitude, slope = linear_amplitude((response[i] - leak) / norm, order, swing_frequency)
        response[i] = amplitude * norm / slope + leak
        design[i, _A] /= slope
        design[i, _U] /= slope


@njit(**INNER)
def least_squares(design: Array, response: Array) -> tuple[Array, bool, float, Array]:
    """Coefficients, whether they are determined, residual sum of squares, and the moment matrix ``X'X``."""
    rows, size = design.shape
    gram = np.zeros((size, size))
    right = np.zeros(size)
    for i in range(rows):
        add_sample(gram, right, design[i], response[i], 1.0)
    for a in range(size):
        for b in range(a):
            gram[b, a] = gram[a, b]
    found, ok = solve_spd(gram, right)
    squares = 0.0
    for i in range(rows):
        residual = response[i]
        for a in range(size):
            residual -= design[i, a] * found[a]
        squares += residual * residual
    return found, ok, squares, gram


class EnvelopeStatistics(NamedTuple):
    """The envelope regressions of many records, reduced.

    Attributes
    ----------
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

    gram: Array
    coefficients: Array
    residual: Array
    rows: Integers
    polynomial: Array


@njit(**KERNEL)
def envelope_statistics(
    records: Array,
    step: float,
    frequency: Array,
    phase: Array,
    start: Integers,
    stop: Integers,
    order: int,
    swing_frequency: float,
) -> EnvelopeStatistics:
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
    EnvelopeStatistics
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
        values, reference = about_mean(records[k, start[k] : stop[k]])
        polynomial = track_phase(values, step, frequency[k], phase[k], order, UNDAMPED)
        if swing_frequency > 0.0:
            response, design, _ = _rows_of_pendulum(values, polynomial, order, swing_frequency)
        else:
            response, design, _ = _rows(values, polynomial, order, _ALL)
        found, ok, left, moments = least_squares(design, response)
        rows[k] = response.size
        for a in range(MAX_DEGREE + 1):
            polynomials[k, a] = polynomial[a]
        if ok:
            for a in range(3):
                coefficients[k, a] = found[a]
                for b in range(3):
                    gram[k, a, b] = moments[a, b]
            coefficients[k, _C] += reference
            residual[k] = left
    return EnvelopeStatistics(gram, coefficients, residual, rows, polynomials)
