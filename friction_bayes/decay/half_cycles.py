"""Half cycles of a free decay, and the friction samples of the paper, from the moving part of a record."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.half_cycle_kernels import (
    peaks_of_periods,
    period_friction,
    small_swing_frequency,
    turning_values,
)
from friction_bayes.decay.phase_tracking import coulomb_fit, track_phase

__all__ = [
    "PEAKS",
    "force_factor",
    "friction_samples",
    "half_cycles",
    "natural_frequency_found",
    "peak_amplitudes",
    "swing_frequency",
    "tracked_phase",
]

PEAKS = ("highest", "nominal")
"""Ways to pick the peak of a period: its highest sample, or the sample where the peak is due."""

Array = NDArray[np.float64]


def tracked_phase(decay: FreeDecay) -> tuple[Array, Array, float]:
    """Phase of a decay as a function of time, from its data.

    Returns
    -------
    polynomial : ndarray, shape (k,)
        Chebyshev coefficients, see :func:`friction_bayes.decay.phase_tracking.track_phase`.
    values : ndarray, shape (n,)
        The samples less ``reference``, for rounding's sake.
    reference : float
        Their mean.
    """
    reference = float(decay.values.mean())
    values = decay.values - reference
    return (
        track_phase(values, decay.step, decay.frequency, decay.phase, decay.quantity.order),
        values,
        reference,
    )


def swing_frequency(system: Oscillator, unit: str) -> float:
    """Natural frequency of a pendulum [rad/s]; zero where amplitudes are taken as those of a linear system.

    Large swings are converted by their angle, which a signal that was not calibrated does not give.
    """
    large_swings = system.pendulum and unit not in UNCALIBRATED_UNITS
    return system.natural_frequency if large_swings else 0.0


def force_factor(system: Oscillator, quantity: Quantity, unit: str) -> float:
    """Factor from the signal's friction coefficient to the friction force; 1 where it was not calibrated."""
    return 1.0 if unit in UNCALIBRATED_UNITS else system.force_factor(quantity)


def half_cycles(decay: FreeDecay) -> xr.Dataset:
    """Turning points of the signal and the half cycles between them.

    A turning point is a local least-squares fit of a constant and a sinusoid to the samples a quarter period
    either side of it, at the phase followed through the record, so that frequency may change with amplitude.
    Windows do not overlap: values have independent errors of one variance. Turning points nearer than a
    quarter period to an end of the record have no whole window and are left out. With fewer than 6 samples
    in half a period only every third (fifth, ...) turning point is kept, and what is said of half cycles is
    their average.

    Turning points are those of the *signal*. In displacement and acceleration they are the motion's; in
    velocity they are its passes through the middle of a half cycle. All amplitudes are in the unit of the
    signal, and fall by ``2 u`` a half cycle, ``u = w0**q r/k``. An acceleration jumps by ``2 u`` at its
    turning points; the value is the mean of both sides.

    Parameters
    ----------
    decay : FreeDecay

    Returns
    -------
    xarray.Dataset
        Over ``turning_point`` (counted in half periods): ``time`` [s, of the record], ``value`` and
        ``amplitude`` (from the rest position, positive). Over ``half_cycle`` (numbered by the turning point
        it begins with): ``centre`` (mean of both ends), ``half_period`` [s], ``direction`` (of the signal,
        +1 or -1) and ``drop`` (loss of amplitude, of one half cycle). Attributes: ``rest_position``,
        ``noise_sd`` of a sample and ``value_sd`` of a turning point, unit of the signal;
        ``derivative_order``; ``half_cycles_per_interval``.

    Raises
    ------
    InputError
        If fewer than two turning points have a whole window.
    """
    polynomial, values, reference = tracked_phase(decay)
    order = decay.quantity.order
    index, time, value, noise_sd, value_sd = turning_values(
        values, decay.step, polynomial, order, swing_frequency(decay.system, decay.unit)
    )
    if index.size < 2 or not np.all(np.isfinite(value)):
        raise InputError(
            decay.name,
            f"{index.size} turning points can be fitted",
            "give a record of at least three half cycles, sampled faster",
        )
    centre = coulomb_fit(values, order, polynomial)[0]
    side = np.where(index % 2 == 0, 1.0, -1.0)
    amplitude = side * (value - centre)
    interval = int(index[1] - index[0])
    value = value + reference
    unit = decay.unit

    def points(data: NDArray[Any], units: str, name: str) -> tuple[str, NDArray[Any], dict[str, str]]:
        return "turning_point", data, {"units": units, "long_name": name}

    def cycles(data: NDArray[Any], units: str, name: str) -> tuple[str, NDArray[Any], dict[str, str]]:
        return "half_cycle", data, {"units": units, "long_name": name}

    return xr.Dataset(
        {
            "time": points(decay.start_time + time, "s", "time of the turning point"),
            "value": points(value, unit, "signal at the turning point"),
            "amplitude": points(amplitude, unit, "amplitude from the rest position"),
            "centre": cycles(0.5 * (value[:-1] + value[1:]), unit, "centre of the half cycle"),
            "half_period": cycles(np.diff(time) / interval, "s", "duration of a half cycle"),
            "direction": cycles(-side[:-1], "1", "direction of the signal"),
            "drop": cycles(-np.diff(amplitude) / interval, unit, "loss of amplitude in a half cycle"),
        },
        coords={
            "turning_point": points(index, "1", "turning point, counted in half periods"),
            "half_cycle": cycles(index[:-1], "1", "half cycle, by its first turning point"),
        },
        attrs={
            "Conventions": "CF-1.11",
            "record": decay.name,
            "quantity": decay.quantity.name,
            "units": unit,
            "derivative_order": order,
            "rest_position": reference + centre,
            "noise_sd": noise_sd,
            "value_sd": value_sd,
            "half_cycles_per_interval": interval,
        },
    )


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
    time, value = peaks_of_periods(values, decay.step, polynomial, peaks == "highest")
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
    return samples * force_factor(decay.system, decay.quantity, decay.unit)


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
