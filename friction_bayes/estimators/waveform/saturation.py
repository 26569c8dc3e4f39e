r"""Whether a sensor saturates before noise is added: tops that are flat, but differ by noise.

The samples well inside the range determine frequency, phase and amplitude of every half cycle, and so what
the others should show. Where these stay at one level instead, whatever they should show beyond it, the
likelihood of a saturated sensor exceeds that of half cycles of the right shape, each of any size ``g``,

.. math:: \Lambda(L) = \sum_{|s_i| > L} \frac{(y_i - d_i - g s_i)^2 - (y_i - L)^2}{2 \mathrm{var}(y_i - s_i)},

with the level ``L`` averaged over the range, on either side or on both. A filter bends the motion near its
corners too, but by the same ``d`` in every half cycle: it is estimated from those with tops below the level.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.estimators.waveform.coulomb_signal import signal_derivatives, signals
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.estimators.waveform.normal_equations import ADVANCE, COEFFICIENTS, PHASE, Samples

__all__ = ["refuse_saturated", "saturation_level"]

_INSIDE = 0.55
"""Levels over the largest excursion: a sensor that saturates lower has lost more than half of the motion."""
_LEVELS = np.linspace(_INSIDE, 1.0, 46)[:-1]
_LOG_PRIOR = math.log(0.01)
"""Of a sensor that saturates, on one side or on both."""
_SURE = math.log(100.0)
_LINEAR = 0.005
"""Of the range, to which sensor and law of motion are taken to be exact."""
_BINS = 24
"""Of the phase of a half cycle, for what all of them have in common."""
_LIKE_NOISE = 3.0
"""Standard deviations by which a flat top may scatter (root mean square): what is further is no flat top."""


def saturation_level(decay: FreeDecay) -> float | None:
    """Level about the rest position at which the sensor saturates, unit of the signal; None without one.

    None also for a pendulum's large swings, or where too few samples lie inside.
    """
    if swing_frequency(decay.system, decay.unit) > 0.0:
        return None
    away = decay.values - decay.rest_position
    largest = float(np.max(np.abs(away)))
    inside = np.abs(away) < _INSIDE * largest
    count = int(np.count_nonzero(inside))
    if count < 4 * COEFFICIENTS:
        return None
    order, places = decay.quantity.order, decay.places
    advance = 0.5 * decay.frequency * decay.duration
    located = decay.located._replace(
        stop=np.array([count]), frequency=np.array([2.0 * advance / (count - 1)])
    )
    fits = fit_waveforms(
        away[inside][None],
        located._replace(rest_position=np.zeros(1)),
        order,
        0.0,
        places=np.ascontiguousarray(places[inside]),
    )
    if not fits.found[0]:
        return None
    p, kappa, stop = fits.coefficients[0], float(fits.kappa[0]), int(fits.stop[0])
    samples = Samples(away.size, np.ascontiguousarray(places))
    expected = signals(samples, order, p[None], kappa, stop)[0]
    noise2 = float(fits.misfit[0]) / (count - COEFFICIENTS)
    jacobian, _ = signal_derivatives(samples, order, p, kappa, stop)
    of_law = np.einsum("ni,ij,nj->n", jacobian, np.linalg.inv(fits.normal[0]), jacobian)
    # errors of sensor and law are alike within a bin: its samples inform about them as one does
    in_bin = max(math.pi * (away.size - 1) / (2.0 * p[ADVANCE] * _BINS), 1.0)
    variance = noise2 * (1.0 + of_law) + in_bin * (_LINEAR * largest) ** 2
    angle = p[ADVANCE] * places + p[PHASE]
    half_cycle = np.rint((angle + 0.5 * order * math.pi) / math.pi).astype(np.int64)
    # a filter is still settling then
    variance[half_cycle <= half_cycle[0]] = np.inf
    phase = angle + 0.5 * order * math.pi - math.pi * half_cycle
    bins = np.clip(((phase / math.pi + 0.5) * _BINS).astype(np.intp), 0, _BINS - 1)
    levels = largest * _LEVELS
    found = np.concatenate(
        [
            _gains(away, expected, 1.0 / variance, half_cycle - half_cycle.min(), bins, *sides, levels)
            for sides in ((True, False), (False, True), (True, True))
        ]
    )
    evidence = float(logsumexp(found)) - math.log(found.size) + _LOG_PRIOR
    return float(levels[int(np.argmax(found)) % levels.size]) if evidence > _SURE else None


def refuse_saturated(decay: FreeDecay) -> None:
    """Refuse a decay whose tops are flat below noise.

    Raises
    ------
    InputError
        Saying how far from the rest position they are flat.
    """
    level = saturation_level(decay)
    if level is not None:
        raise InputError(
            decay.name,
            f"the sensor saturates: tops are flat some {level:.4g} {decay.unit} from the rest position",
            "start after them (--start), or take a sensor with more range",
        )


@njit(**KERNEL)
def _gains(
    away: Array,
    expected: Array,
    weight: Array,
    half_cycle: Integers,
    bins: Integers,
    upper: bool,
    lower: bool,
    levels: Array,
) -> Array:
    """Log likelihood ratio of a sensor that saturates at each level, on the upper side, the lower or both.

    Arguments, shape (n,) each: samples about the rest position, their expected values, weights, half cycles
    and bins of the phase. Minus infinity where tops scatter by more than noise.
    """
    n, half_cycles = away.size, 0
    for which in half_cycle:
        half_cycles = max(half_cycles, which + 1)
    gains = np.empty(levels.size)
    beyond = np.empty(n, dtype=np.bool_)
    for i, level in enumerate(levels):
        reach = np.zeros(half_cycles, dtype=np.bool_)
        flat, used = 0.0, 0
        for k in range(n):
            if flat > _LIKE_NOISE**2 * n:
                break
            beyond[k] = (upper and expected[k] > level) or (lower and -expected[k] > level)
            reach[half_cycle[k]] |= beyond[k]
            if beyond[k]:
                flat += weight[k] * (abs(away[k]) - level) ** 2
                used += weight[k] > 0.0
        if not flat <= _LIKE_NOISE**2 * used:
            gains[i] = -np.inf
            continue
        # the deviation from the law in half cycles below the level
        common, total = np.zeros(_BINS), np.zeros(_BINS)
        for k in range(n):
            if not reach[half_cycle[k]]:
                total[bins[k]] += weight[k]
                common[bins[k]] += weight[k] * np.sign(expected[k]) * (away[k] - expected[k])
        for j in range(_BINS):
            common[j] /= total[j] if total[j] > 0.0 else 1.0
        crossed, square = np.zeros(half_cycles), np.zeros(half_cycles)
        for k in range(n):
            if beyond[k]:
                other = away[k] - np.sign(expected[k]) * common[bins[k]]
                crossed[half_cycle[k]] += weight[k] * other * expected[k]
                square[half_cycle[k]] += weight[k] * expected[k] * expected[k]
        for j in range(half_cycles):
            crossed[j] /= square[j] if square[j] > 0.0 else 1.0
        own = 0.0
        for k in range(n):
            if beyond[k]:
                other = away[k] - np.sign(expected[k]) * common[bins[k]]
                own += weight[k] * (other - crossed[half_cycle[k]] * expected[k]) ** 2
        gains[i] = 0.5 * (own - flat)
    return gains
