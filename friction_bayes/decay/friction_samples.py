"""The friction samples of the paper: one peak a period, and a friction force from each two successive ones.

The kernels take the moving samples and the phase polynomial of
:func:`friction_bayes.decay.phase_tracking.track_phase`; a loop over records in compiled code serves batches.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.decay.block_means import about_mean
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.phase_polynomial import phase_at, time_of_phase
from friction_bayes.decay.phase_tracking import UNDAMPED, coulomb_fit, track_phase, tracked_phase
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.mechanics.pendulum import frequency_ratio, friction_of_period, swing_amplitude

__all__ = [
    "PEAKS",
    "friction_sample_statistics",
    "friction_samples",
    "natural_frequency_found",
    "peak_amplitudes",
]

PEAKS = ("highest", "nominal")
"""Ways to pick the peak of a period: its highest sample, or the sample where the peak is due."""
_LANES = 32
"""Samples compared side by side: compilers keep no running largest of one number."""


def peak_amplitudes(decay: FreeDecay, peaks: str = "highest") -> tuple[Array, Array]:
    """Successive amplitudes on the positive side of the signal, one a period, as the paper takes them.

    Parameters
    ----------
    decay : FreeDecay
    peaks : {"highest", "nominal"}
        The highest sample of each period, from trough to trough, or the sample nearest to where the peak is
        due. An incomplete first or last period is not used.

    Returns
    -------
    time : ndarray, shape (periods,)
        In the time of the record [s].
    amplitude : ndarray, shape (periods,)
        From the rest position found in the data, unit of the signal.

    Raises
    ------
    InputError
        If ``peaks`` is neither, or fewer than two periods are complete.
    """
    if peaks not in PEAKS:
        raise InputError("peaks", f"unknown choice {peaks!r}", f"give one of {', '.join(PEAKS)}")
    polynomial, values, _ = tracked_phase(decay)
    time, value = _peaks_of_periods(values, decay.step, polynomial, peaks == "highest")
    if value.size < 2:
        raise InputError(
            decay.name,
            f"{value.size} complete period(s), and a friction sample takes two amplitudes",
            "give a longer record or use the methods envelope or waveform",
        )
    return decay.start_time + time, value - coulomb_fit(values, decay.quantity.order, polynomial)[0]


def friction_samples(decay: FreeDecay, peaks: str = "highest") -> Array:
    r"""Friction force from each two successive amplitudes: the data of the paper's two conjugate models.

    The amplitude falls by ``4 u`` a period, Eq. (2), so ``r_i = factor (A_i - A_{i+1}) / 4`` with
    :meth:`~friction_bayes.core.system.Oscillator.force_factor`. A pendulum's amplitudes are turned
    into angles and ``r_i`` is the energy lost over the path, ``k (cos A_{i+1} - cos A_i) / (2 (A_i +
    A_{i+1}))`` to third order in the loss. Successive samples share an amplitude: their errors are
    correlated at -1/2.

    Parameters
    ----------
    decay : FreeDecay
    peaks : {"highest", "nominal"}
        See :func:`peak_amplitudes`.

    Returns
    -------
    ndarray, shape (periods - 1,)
        Friction force [N, or N m]; the signal's friction coefficient where it was not calibrated.

    Raises
    ------
    InputError
        As :func:`peak_amplitudes`; and if a pendulum's peaks exceed what any swing reaches.
    """
    _, amplitude = peak_amplitudes(decay, peaks)
    samples = period_friction(amplitude, 0.0, decay.quantity.order, swing_frequency(decay.system, decay.unit))
    if not np.all(np.isfinite(samples)):
        raise InputError(
            decay.name,
            f"a peak of {np.abs(amplitude).max():g} {decay.unit} exceeds any swing of the declared pendulum",
            "check inertia, stiffness and unit",
        )
    return samples * decay.force_factor


def natural_frequency_found(decay: FreeDecay, peaks: str = "highest") -> float:
    """Rough frequency of small motion [rad/s] in the data; that of a pendulum is freed of its large swings.

    Raises
    ------
    InputError
        As :func:`peak_amplitudes`.
    """
    swing = swing_frequency(decay.system, decay.unit)
    if swing == 0.0:
        return decay.frequency
    polynomial, values, _ = tracked_phase(decay)
    _, amplitude = peak_amplitudes(decay, peaks)
    duration = (values.size - 1) * decay.step
    return float(small_swing_frequency(polynomial, duration, amplitude, 0.0, decay.quantity.order, swing))


@njit(**INNER)
def _highest(values: Array) -> int:
    """First of the highest of finite values; found by blocks, which are compared side by side."""
    lanes, whole = np.full(_LANES, -math.inf), values.size // _LANES * _LANES
    for begin in range(0, whole, _LANES):
        part = values[begin : begin + _LANES]
        for j in range(_LANES):
            lanes[j] = part[j] if part[j] > lanes[j] else lanes[j]
    most = -math.inf
    for j in range(_LANES):
        most = max(most, lanes[j])
    for i in range(whole, values.size):
        most = max(most, values[i])
    at = 0
    while values[at] < most:
        at += 1
    return at


@njit(**KERNEL)
def _peaks_of_periods(values: Array, step: float, polynomial: Array, highest: bool) -> tuple[Array, Array]:
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
            at = begin + _highest(values[begin:end])
        else:
            at = min(max(round(time_of_phase(polynomial, target, duration) / step), 0), n - 1)
        time[w] = at * step
        value[w] = values[at]
    return time, value


@njit(**KERNEL)
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


@njit(**KERNEL)
def small_swing_frequency(
    polynomial: Array, duration: float, peaks: Array, centre: float, order: int, swing_frequency: float
) -> float:
    """Frequency [rad/s] of a pendulum's small swings: rate of its phase over the mean slowing of its peaks.

    A peak is taken for the fundamental of its period, which it exceeds by less than 1 % up to 1 rad.
    """
    first, _ = phase_at(polynomial, -1.0)
    last, _ = phase_at(polynomial, 1.0)
    slowing = 0.0
    for j in range(peaks.size):
        slowing += frequency_ratio((peaks[j] - centre) / swing_frequency**order, order) / peaks.size
    return (last - first) / duration / slowing


@njit(**KERNEL)
def friction_sample_statistics(
    records: Array,
    step: float,
    frequency: Array,
    phase: Array,
    start: Integers,
    stop: Integers,
    order: int,
    swing_frequency: float,
    highest: bool,
) -> tuple[Integers, Array, Array, Array]:
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
        values, _ = about_mean(records[k, start[k] : stop[k]])
        polynomial = track_phase(values, step, frequency[k], phase[k], order, UNDAMPED)
        _, peaks = _peaks_of_periods(values, step, polynomial, highest)
        centre = 0.0
        if swing_frequency > 0.0:
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
