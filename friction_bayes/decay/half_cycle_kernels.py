"""Kernels on one record: the signal at its turning points, and the paper's peaks, one a period.

They take the moving samples and the phase polynomial of
:func:`friction_bayes.decay.phase_tracking.track_phase`; a loop over records in compiled code serves batches.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from friction_bayes.decay.phase_polynomial import coulomb_shapes, phase_at, time_of_phase
from friction_bayes.decay.phase_tracking import coulomb_fit, solve_spd, track_phase
from friction_bayes.mechanics.pendulum import (
    frequency_ratio,
    friction_of_period,
    swing_amplitude,
    third_harmonic,
)

__all__ = [
    "friction_sample_statistics",
    "peaks_of_periods",
    "period_friction",
    "small_swing_frequency",
    "turning_values",
]

_MIN_SAMPLES = 6.0

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def turning_values(
    values: Array, step: float, polynomial: Array, order: int, swing_frequency: float
) -> tuple[NDArray[np.int64], Array, Array, float, float]:
    """Fit the signal about its turning points in disjoint windows, each with {1, cos, sin} of the phase.

    A window reaches half the distance to the next turning point used: a quarter period, or, where half a
    period holds fewer than 6 samples, enough for 6 while only every third, fifth, ... turning point is used,
    so that sides alternate. Errors are then independent and, to the accuracy of the sampling, of one
    variance. Windows that reach beyond the record are left out.

    About turning point ``j`` the even part of a Coulomb decay is exactly ``(a - (2j - q) u) cos``; the odd
    part, a known multiple of ``u``, moves the local phase and, where sampling is uneven, the value. It is
    taken out, and so is the third harmonic of a pendulum.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The moving samples.
    step : float
        Sampling interval [s].
    polynomial : ndarray, shape (k,)
        Phase of the signal.
    order : int
        Derivative order ``q`` of the signal.
    swing_frequency : float
        Natural frequency of a pendulum [rad/s]; zero for a linear system.

    Returns
    -------
    index : ndarray of int, shape (m,)
        Which turning points, counted in half periods from phase zero.
    time : ndarray, shape (m,)
        When, by the local phase [s since the first sample].
    value : ndarray, shape (m,)
        Fitted signal there.
    noise_sd : float
        Standard deviation of the samples about the fits.
    value_sd : float
        Standard error of a value (root mean square over the windows).
    """
    n = values.size
    duration = (n - 1) * step
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    rate = (last - first) / (n - 1)
    stride = math.ceil(_MIN_SAMPLES * rate / math.pi)
    stride += 1 - stride % 2
    reach = 0.5 * math.pi * stride
    lowest = math.ceil((first + reach - 0.75 * rate) / math.pi)
    highest = math.floor((last - reach + 0.75 * rate) / math.pi)
    count = max((highest - lowest) // stride + 1, 0)
    index = lowest + stride * np.arange(count)
    time, value = np.zeros(count), np.zeros(count)
    centre, _, friction = coulomb_fit(values, order, polynomial)
    squares, freedom, spread = 0.0, 0, 0.0
    shift = 0.5 * order * math.pi
    basis = np.ones(3)
    for w in range(count):
        target = index[w] * math.pi
        sign = 1.0 if index[w] % 2 == 0 else -1.0
        begin = max(math.ceil(time_of_phase(polynomial, target - reach, duration) / step), 0)
        end = min(math.ceil(time_of_phase(polynomial, target + reach, duration) / step), n)
        matrix = np.zeros((3, 3))
        signal, third = np.zeros(3), np.zeros(3)
        square = 0.0
        for i in range(begin, end):
            chi, _ = phase_at(polynomial, 2.0 * i / (n - 1) - 1.0)
            psi = chi - target
            basis[1], basis[2] = math.cos(psi), math.sin(psi)
            _, g, _, _ = coulomb_shapes(chi - shift, order)
            y = values[i] - centre - friction * (g + (2 * index[w] - order) * sign * basis[1])
            square += y * y
            for a in range(3):
                signal[a] += basis[a] * y
                third[a] += basis[a] * math.cos(3.0 * psi)
                for b in range(a + 1):
                    matrix[a, b] += basis[a] * basis[b]
        fit, ok = solve_spd(matrix, signal)
        if not ok:
            value[w] = np.nan
            continue
        squares += max(square - (fit * signal).sum(), 0.0)
        freedom += end - begin - 3
        weight, _ = solve_spd(matrix, np.array([1.0, 1.0, 0.0]))
        spread += weight[0] + weight[1]
        value[w] = centre + fit[0] + fit[1]
        if swing_frequency > 0.0:
            third_fit, _ = solve_spd(matrix, third)
            share = third_harmonic(fit[1] / swing_frequency**order, order)
            value[w] += fit[1] * share * (1.0 - third_fit[0] - third_fit[1])
        at = time_of_phase(polynomial, target, duration)
        _, slope = phase_at(polynomial, 2.0 * at / duration - 1.0)
        lag = math.atan2(sign * fit[2], sign * fit[1])
        time[w] = at + 0.5 * duration * min(max(lag, -0.5 * math.pi), 0.5 * math.pi) / slope
    noise_sd = math.sqrt(squares / freedom) if freedom > 0 else np.nan
    value_sd = noise_sd * math.sqrt(spread / count) if count > 0 else np.nan
    return index, time, value, noise_sd, value_sd


@njit(cache=True, nogil=True)
def peaks_of_periods(values: Array, step: float, polynomial: Array, highest: bool) -> tuple[Array, Array]:
    """One peak a period, on the positive side: its highest sample, or the sample where the peak is due.

    A period reaches half a period either side of its peak, and counts only if all of it lies in the record:
    one that begins at a release has seen no more than half of its first peak.

    Returns
    -------
    time, value : ndarray, shape (periods,)
        Seconds since the first sample, and the samples.
    """
    n = values.size
    duration = (n - 1) * step
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    rate = (last - first) / (n - 1)
    turn = 2.0 * math.pi
    lowest = math.ceil((first - rate + math.pi) / turn)
    count = max(math.floor((last + rate - math.pi) / turn) - lowest + 1, 0)
    time, value = np.zeros(count), np.zeros(count)
    for w in range(count):
        target = (lowest + w) * turn
        if highest:
            begin = max(math.ceil(time_of_phase(polynomial, target - math.pi, duration) / step), 0)
            end = min(math.ceil(time_of_phase(polynomial, target + math.pi, duration) / step), n)
            at = begin + int(np.argmax(values[begin:end]))
        else:
            at = min(max(round(time_of_phase(polynomial, target, duration) / step), 0), n - 1)
        time[w] = at * step
        value[w] = values[at]
    return time, value


@njit(cache=True, nogil=True)
def period_friction(peaks: Array, centre: float, order: int, swing_frequency: float) -> Array:
    """Friction coefficient ``u`` of the signal from each two successive peaks, shape (periods - 1,).

    A linear system loses ``4 u`` of amplitude a period. A pendulum loses the energy between its amplitudes
    over the path between them (:func:`friction_bayes.mechanics.pendulum.friction_of_period`); NaN where a
    peak is more than any swing reaches.
    """
    result = np.zeros(max(peaks.size - 1, 0))
    for j in range(result.size):
        if swing_frequency > 0.0:
            before = swing_amplitude(peaks[j] - centre, order, swing_frequency)
            after = swing_amplitude(peaks[j + 1] - centre, order, swing_frequency)
            result[j] = swing_frequency**order * friction_of_period(before, after)
        else:
            result[j] = 0.25 * (peaks[j] - peaks[j + 1])
    return result


@njit(cache=True, nogil=True)
def small_swing_frequency(
    polynomial: Array, duration: float, peaks: Array, centre: float, order: int, swing_frequency: float
) -> float:
    """Frequency [rad/s] of a pendulum's small swings: rate of its phase over the mean slowing of its peaks.

    A peak stands for the fundamental of its period, which it exceeds by less than 1 % up to 1 rad.
    """
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    slowing = 0.0
    for j in range(peaks.size):
        slowing += frequency_ratio((peaks[j] - centre) / swing_frequency**order, order) / peaks.size
    return (last - first) / duration / slowing


@njit(cache=True, nogil=True)
def friction_sample_statistics(
    records: Array,
    step: float,
    frequency: Array,
    phase: Array,
    start: NDArray[np.int64],
    stop: NDArray[np.int64],
    order: int,
    swing_frequency: float,
    highest: bool,
) -> tuple[NDArray[np.int64], Array, Array, Array]:
    """Sufficient statistics of the paper's friction samples, in the signal's units, for many records at once.

    Parameters
    ----------
    records, step, frequency, phase, start, stop, order, swing_frequency
        As in :func:`friction_bayes.estimators.envelope.half_cycle_rows.envelope_statistics`.
    highest : bool
        Highest sample of each period, else the sample where the peak is due.

    Returns
    -------
    count : ndarray of int, shape (r,)
        Friction samples: amplitudes less one; zero for a record skipped.
    mean, squares : ndarray, shape (r,)
        Their mean and the sum of their squared deviations from it; NaN where there is none.
    natural : ndarray, shape (r,)
        Frequency of small motion [rad/s]: ``frequency``, or :func:`small_swing_frequency` of a pendulum.
    """
    r = records.shape[0]
    count = np.zeros(r, dtype=np.int64)
    mean = np.full(r, np.nan)
    squares = np.full(r, np.nan)
    natural = frequency.copy()
    for k in range(r):
        if stop[k] - start[k] < 8:
            continue
        values = records[k, start[k] : stop[k]]
        values = values - values.mean()
        polynomial = track_phase(values, step, frequency[k], phase[k], order)
        _, peaks = peaks_of_periods(values, step, polynomial, highest)
        centre, _, _ = coulomb_fit(values, order, polynomial)
        samples = period_friction(peaks, centre, order, swing_frequency)
        if samples.size > 0:
            count[k] = samples.size
            mean[k] = samples.mean()
            squares[k] = ((samples - mean[k]) ** 2).sum()
            if swing_frequency > 0.0:
                duration = (values.size - 1) * step
                natural[k] = small_swing_frequency(
                    polynomial, duration, peaks, centre, order, swing_frequency
                )
    return count, mean, squares, natural
