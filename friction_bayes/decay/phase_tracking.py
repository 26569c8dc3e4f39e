"""The phase of a free decay as a smooth function of time, from the data; frequency may change with amplitude.

Two steps. A tracker goes through the record period by period, predicting each from the ones before it, so
that a rough frequency suffices. Gauss-Newton then refines a polynomial phase together with the Coulomb
amplitudes, from moments of the samples over half cycles. Phase errors are orthogonal to amplitude errors to
first order, so a phase with more freedom than a linear system needs costs no precision in friction. Half
cycles under viscous damping are no pure cosines: where it may act it is fitted too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import about_mean, fill_block_means, samples_in_block
from friction_bayes.decay.demodulation import demodulate, fill_turns
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.linear_least_squares import add_sample, solve_spd
from friction_bayes.decay.phase_polynomial import phase_at, rises, time_of_phase

__all__ = [
    "COS",
    "LATER_COS",
    "MAX_DEGREE",
    "ONE",
    "SIN",
    "UNDAMPED",
    "coulomb_fit",
    "half_cycle_moments",
    "nearest_turning_points",
    "track_phase",
    "tracked_phase",
]

MAX_DEGREE = 5
"""Highest degree of the phase polynomial; a pendulum's phase is odd in time to this order at 1 rad."""

UNDAMPED = np.False_
"""For kernels that track the phase of dry friction alone: for a literal numba would compile it once more."""

_SETTLED = 1e-5
"""Step [rad] after which Gauss-Newton ends; the next would be a tenth of it at most."""
ONE, COS, SIN, LATER_SIN, LATER_COS = range(5)
"""Functions of a half cycle whose moments are taken."""
_MOMENTS = 5
_FREQUENCY_SD = 0.05
_FREQUENCY_WANDER = 0.003
_PHASE_SD = 0.5


@njit(**INNER)
def _track(values: Array, step: float, frequency: float, chi0: float) -> tuple[Array, Array, Array]:
    """Follow the phase of the signal through successive windows of one period.

    A Kalman filter of phase and frequency: a window whose amplitude is lost in noise hardly moves it.

    Returns
    -------
    times, phases, weights : ndarray, shape (windows,)
        Window centres [s], phases found there [rad] and inverse variances.
    """
    centre, inphase, quadrature, noise = demodulate(values, frequency * step)
    # windows are half a period apart: every second shares no sample with the next
    windows = (centre.size + 1) // 2
    times, phases, weights = np.zeros(windows), np.zeros(windows), np.zeros(windows)
    chi, omega, now = chi0, frequency, 0.0
    p00, p01, p11 = _PHASE_SD**2, 0.0, (_FREQUENCY_SD * frequency) ** 2
    for w in range(windows):
        k = 2 * w
        dt = centre[k] * step - now
        chi += omega * dt
        p00 += 2.0 * dt * p01 + dt * dt * p11
        p01 += dt * p11
        p11 += (_FREQUENCY_WANDER * frequency) ** 2
        now += dt
        power = inphase[k] ** 2 + quadrature[k] ** 2
        times[w], phases[w] = now, chi
        if power <= 0.0:
            continue
        variance = noise[k] ** 2 / power + 1e-8
        innovation = math.atan2(quadrature[k], inphase[k]) + frequency * now - chi
        innovation -= 2.0 * math.pi * round(innovation / (2.0 * math.pi))
        phases[w] = chi + innovation
        weights[w] = 1.0 / variance
        total = p00 + variance
        gain0, gain1 = p00 / total, p01 / total
        chi += gain0 * innovation
        omega += gain1 * innovation
        p11 -= gain1 * p01
        p01 -= gain0 * p01
        p00 -= gain0 * p00
    return times, phases, weights


@njit(**INNER)
def _polynomial_through(
    times: Array, phases: Array, weights: Array, duration: float, degree: int
) -> tuple[Array, bool]:
    """Weighted least squares of a Chebyshev polynomial through the tracked phases."""
    size = degree + 1
    matrix = np.zeros((size, size))
    right = np.zeros(size)
    basis = np.zeros(size)
    for w in range(times.size):
        position = 2.0 * times[w] / duration - 1.0
        for k in range(size):
            basis[k] = (
                1.0 if k == 0 else (position if k == 1 else 2.0 * position * basis[k - 1] - basis[k - 2])
            )
        add_sample(matrix, right, basis, phases[w], weights[w])
    return solve_spd(matrix, right)


class _HalfCycles(NamedTuple):
    """Moments of samples over the half cycles of a phase ``chi``: all that a regression needs of them.

    Attributes
    ----------
    number : ndarray of int, shape (m,)
        Of each half cycle, ``floor(theta / pi)`` with the displacement's phase ``theta``.
    place : ndarray, shape (m,)
        Position of its middle.
    matrix, right : ndarray, shapes (m, 5, 5) and (m, 5)
        Moments of ``1, cos(chi), sin(chi), t sin(chi), t cos(chi)`` with each other and with the samples,
        ``t`` being the position less that of the middle.
    """

    number: Integers
    place: Array
    matrix: Array
    right: Array


@njit(**INNER, fastmath={"reassoc", "contract"})
def _add_half_cycle(
    y: Array, cosine: Array, sine: Array, spacing: float, matrix: Array, right: Array
) -> None:
    """Add up the moments of :class:`_HalfCycles`, several samples at a time."""
    c = s = cc = sc = ts = tsc = tss = tsts = tc = tcc = tctc = tcts = one = yc = ys = yts = ytc = 0.0
    first = -0.5 * (y.size - 1) * spacing
    for j in range(y.size):
        value, a, b = y[j], cosine[j], sine[j]
        t = first + j * spacing
        d, e = t * b, t * a
        c, s, cc, sc = c + a, s + b, cc + a * a, sc + a * b
        ts, tsc, tss, tsts = ts + d, tsc + d * a, tss + d * b, tsts + d * d
        tc, tcc, tctc, tcts = tc + e, tcc + e * a, tctc + e * e, tcts + e * d
        one, yc, ys = one + value, yc + value * a, ys + value * b
        yts, ytc = yts + value * d, ytc + value * e
    n = float(y.size)
    matrix[0, 0] = n
    matrix[1, 0], matrix[1, 1] = c, cc
    matrix[2, 0], matrix[2, 1], matrix[2, 2] = s, sc, n - cc
    matrix[3, 0], matrix[3, 1], matrix[3, 2], matrix[3, 3] = ts, tsc, tss, tsts
    matrix[4, 0], matrix[4, 1], matrix[4, 2], matrix[4, 3], matrix[4, 4] = tc, tcc, tsc, tcts, tctc
    for i in range(_MOMENTS):
        for j in range(i):
            matrix[j, i] = matrix[i, j]
    right[0], right[1], right[2], right[3], right[4] = one, yc, ys, yts, ytc


@njit(**INNER)
def half_cycle_moments(
    values: Array, begin: float, spacing: float, order: int, polynomial: Array
) -> _HalfCycles:
    """Moments over the half cycles of a phase polynomial, which is a parabola within each.

    The positions of the values are ``begin + i spacing``.
    """
    n, shift = values.size, 0.5 * order * math.pi
    first = math.floor((phase_at(polynomial, begin)[0] - shift) / math.pi)
    count = math.floor((phase_at(polynomial, begin + (n - 1) * spacing)[0] - shift) / math.pi) - first + 1
    found = _HalfCycles(
        np.empty(count, np.int64),
        np.zeros(count),
        np.zeros((count, _MOMENTS, _MOMENTS)),
        np.zeros((count, _MOMENTS)),
    )
    cosine, sine = np.empty(n), np.empty(n)
    i = ZERO
    for k in range(count):
        found.number[k] = first + k
        end = n
        if k + 1 < count:
            turn = time_of_phase(polynomial, (first + k + 1) * math.pi + shift, 2.0) - 1.0
            end = min(max(math.ceil((turn - begin) / spacing), i), n)
        size, reach = end - i, 0.5 * (end - i - 1) * spacing
        place = begin + i * spacing + reach
        found.place[k] = place
        if size > 0:
            before, middle = phase_at(polynomial, place - reach)[0], phase_at(polynomial, place)[0]
            after = phase_at(polynomial, place + reach)[0]
            c, s = cosine[:size], sine[:size]
            fill_turns(before, (after - before) / max(size - 1, 1), c, s)
            bend = middle - 0.5 * (before + after)
            for j in range(size if bend != 0.0 else 0):
                part = (2.0 * j - (size - 1)) / (size - 1)
                turned = bend * (1.0 - part * part)
                kept = 1.0 - 0.5 * turned * turned
                c[j], s[j] = kept * c[j] - turned * s[j], kept * s[j] + turned * c[j]
            _add_half_cycle(values[i:end], c, s, spacing, found.matrix[k], found.right[k])
        i = end
    return found


@njit(**INNER)
def _refine(cycles: _HalfCycles, order: int, polynomial: Array, law: Array, free: int) -> tuple[Array, bool]:
    """One Gauss-Newton step in the law and in ``free`` coefficients of the phase, all of them or none.

    The ``law``, as it was before, is ``(c, a, u)``, followed by a damping where there may be one: its half
    cycles are no pure cosines, and what is no cosine would pass for an error of the phase.
    """
    columns, phase = law.size + free, law.size
    matrix, right = np.zeros((columns, columns)), np.zeros(columns)
    weight = np.zeros((columns, _MOMENTS))
    weight[0, ONE] = weight[1, COS] = 1.0
    damping = law[3] if law.size > 3 else 0.0
    swing, lost, place = 0.0, 0.0, cycles.place[0]
    for k in range(cycles.number.size):
        own, seen, position = cycles.matrix[k], cycles.right[k], cycles.place[k]
        odd = 2.0 * cycles.number[k] + 1.0
        if order == 0:
            weight[2, ONE] = 1.0 if cycles.number[k] % 2 == 0 else -1.0
        weight[2, COS] = -odd
        # what damping has taken is the integral of the swing, by the trapezoidal rule between the middles
        reach = 0.5 * (position - place)
        lost += reach * swing
        swing = max((law[1] - odd * law[2] - damping * lost) / (1.0 + damping * reach), 0.0)
        lost += reach * swing
        place = position
        if law.size > 3:
            _, rate = phase_at(polynomial, position)
            weight[3, COS], weight[3, LATER_COS] = -lost, -swing
            # at its turning points the velocity is zero
            weight[3, SIN] = (1 - order) * swing / rate
        # the Chebyshev polynomials and their slopes at the middle
        before, now, slope_before, slope_now = 1.0, position, 0.0, 1.0
        for m in range(phase, columns):
            weight[m, SIN], weight[m, LATER_SIN] = -swing * before, -swing * slope_before
            before, now, slope_before, slope_now = (
                now,
                2.0 * position * now - before,
                slope_now,
                2.0 * now + 2.0 * position * slope_now - slope_before,
            )
        for i in range(columns):
            for b in range(_MOMENTS):
                product = 0.0
                for a in range(_MOMENTS):
                    product += weight[i, a] * own[a, b]
                for j in range(i + 1):
                    matrix[i, j] += product * weight[j, b]
                right[i] += weight[i, b] * seen[b]
    return solve_spd(matrix, right)


@njit(**INNER)
def _settle(
    values: Array, begin: float, spacing: float, order: int, result: Array, degree: int, damped: bool
) -> None:
    """Gauss-Newton of phase, amplitudes and middle, while the phase in ``result`` rises."""
    polynomial = result[: degree + 1].copy()
    cycles = half_cycle_moments(values, begin, spacing, order, polynomial)
    law = np.zeros(4 if damped else 3)
    found, ok = _refine(cycles, order, polynomial, np.zeros(3), ZERO)
    for k in range(3):
        law[k] = found[k]
    for again in range(12):
        if again > 0:
            cycles = half_cycle_moments(values, begin, spacing, order, polynomial)
        if not ok:
            break
        found, ok = _refine(cycles, order, polynomial, law, polynomial.size)
        if not ok:
            break
        largest = 0.0
        for k in range(degree + 1):
            largest += abs(found[law.size + k])
        scale = 0.5 / largest if largest > 0.5 else 1.0
        for k in range(degree + 1):
            polynomial[k] += scale * found[law.size + k]
        law = found[: law.size]
        if not rises(polynomial):
            break
        for k in range(degree + 1):
            result[k] = polynomial[k]
        if largest < _SETTLED:
            break


@njit(**KERNEL)
def coulomb_fit(values: Array, order: int, polynomial: Array) -> tuple[float, float, float]:
    """Least-squares rest position, initial amplitude and friction coefficient at a given phase, or NaN."""
    cycles = half_cycle_moments(values, -1.0, 2.0 / (values.size - 1), order, polynomial)
    found, ok = _refine(cycles, order, polynomial, np.zeros(3), ZERO)
    if not ok:
        return np.nan, np.nan, np.nan
    return found[0], found[1], found[2]


@njit(**KERNEL)
def track_phase(
    values: Array, step: float, frequency: float, phase: float, order: int, damped: bool
) -> Array:
    r"""Find the phase of a free decay as a Chebyshev polynomial of time.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The moving samples; take a constant near their mean off before, for rounding's sake.
    step : float
        Sampling interval [s].
    frequency, phase : float
        Rough angular frequency [rad/s] and displacement phase ``theta`` of the first sample [rad].
    order : int
        Derivative order ``q`` of the signal.
    damped : bool
        Whether the amplitude may be lost by viscous damping as well; the phase is less precise then.

    Returns
    -------
    ndarray, shape (MAX_DEGREE + 1,)
        Coefficients of the phase ``chi = theta + q pi/2`` of the *signal* (zero at a positive extremum),
        over position -1 (first sample) to 1 (last). Degree one for every six half cycles, at least 1.

    Notes
    -----
    Means of a two-hundredth of a period have all that the samples know of the phase, but for about a
    hundredth of its standard error; not those of an acceleration, which jumps within them.
    """
    n = values.size
    duration = (n - 1) * step
    result = np.zeros(MAX_DEGREE + 1)
    chi0 = phase + 0.5 * order * math.pi
    result[0] = chi0 + 0.5 * frequency * duration
    result[1] = 0.5 * frequency * duration
    if n < 8:
        return result
    width = samples_in_block(2.0 * math.pi / (frequency * step)) if order < 2 else 1
    means = np.empty(n // width)
    fill_block_means(values, width, 0.0, means)
    middle = 0.5 * (width - 1)
    begin, spacing = 2.0 * middle / (n - 1) - 1.0, 2.0 * width / (n - 1)
    after = middle * step
    times, phases, weights = _track(means, width * step, frequency, chi0 + frequency * after)
    for w in range(times.size):
        times[w] += after
    half_cycles = frequency * duration / math.pi
    degree = min(MAX_DEGREE, max(1, int(half_cycles / 6.0)))
    for trial in (min(degree, times.size - 2), 1):
        if trial < 1 or times.size < 2:
            continue
        coefficients, ok = _polynomial_through(times, phases, weights, duration, trial)
        if ok and rises(coefficients):
            for k in range(MAX_DEGREE + 1):
                result[k] = coefficients[k] if k <= trial else 0.0
            break
    _settle(means, begin, spacing, order, result, degree, damped)
    return result


def tracked_phase(decay: FreeDecay, *, damped: bool = False) -> tuple[Array, Array, float]:
    """Phase of a decay on an even grid as a function of time, from its data.

    Parameters
    ----------
    decay : FreeDecay
    damped : bool
        As for :func:`track_phase`.

    Returns
    -------
    polynomial : ndarray, shape (k,)
        Chebyshev coefficients, see :func:`track_phase`.
    values : ndarray, shape (n,)
        The samples less ``reference``, for rounding's sake.
    reference : float
        Their mean.
    """
    assert decay.evenly_spaced
    values, reference = about_mean(decay.values)
    polynomial = track_phase(values, decay.step, decay.frequency, decay.phase, decay.quantity.order, damped)
    return polynomial, values, reference


def nearest_turning_points(decay: FreeDecay) -> Mask:
    """Which samples of a decay lie nearest to its turning points, one each, shape (n,)."""
    polynomial, _, _ = tracked_phase(decay.on_even_grid())
    half_cycles = np.polynomial.chebyshev.chebval(decay.places, polynomial) / math.pi
    return np.asarray(np.abs(half_cycles - np.rint(half_cycles)) <= 0.5 * np.gradient(half_cycles))
