"""Half cycles of a free decay: the turning points of the signal, and what lies between them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.linear_least_squares import add_sample, solve_spd
from friction_bayes.decay.phase_polynomial import phase_at, time_of_phase
from friction_bayes.decay.phase_tracking import coulomb_fit, tracked_phase
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.mechanics.coulomb import coulomb_shapes
from friction_bayes.mechanics.pendulum import third_harmonic

__all__ = ["half_cycles", "turning_values"]

_MIN_SAMPLES = 6.0
"""Samples that a window about a turning point holds at least."""


@njit(**KERNEL)
def turning_values(
    values: Array, step: float, polynomial: Array, order: int, swing_frequency: float
) -> tuple[Integers, Array, Array, float, float]:
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
            add_sample(matrix, signal, basis, y, 1.0)
            square += y * y
            for a in range(3):
                third[a] += basis[a] * math.cos(3.0 * psi)
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
    decay = decay.on_even_grid()
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
