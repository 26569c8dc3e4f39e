"""What the residual of a fit shows that is no force on the mass, found one by one and taken out.

Single samples far outside the noise, lines in its spectrum as of the mains or of another mode, and a zero
that drifts. Left in, each passes for a random force or for coloured noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.decay.spectral_lines import LINES_APART, Line, LineSearch, decaying_lines, steady_lines
from friction_bayes.estimators.base import Fit, FittedMotion
from friction_bayes.estimators.noise.coulomb_regression import PlainDecay
from friction_bayes.estimators.noise.noise_accounts import needs_no_force
from friction_bayes.estimators.noise.stray_samples import stray_samples
from friction_bayes.estimators.noise.zero_drift import zero_drift

__all__ = ["plain_decay", "without_sensor_faults"]

_MOST_FITS = 12
"""Without stray samples, or lines: the first may hide others."""
_LOWEST = 1.5
"""Frequency over the motion's below which another law, or a force, leaves what looks like lines."""
_FROM_TURN = 0.5
"""Phase from a turning point, about, within which a filter may round a velocity or acceleration."""


def without_sensor_faults(
    decay: FreeDecay, fit: Fit, fit_of: Callable[[FreeDecay], Fit]
) -> tuple[FreeDecay, Fit]:
    """The decay without stray samples, lines and a drift of the zero, and its fit.

    Parameters
    ----------
    decay : FreeDecay
    fit : Fit
        Of all its samples.
    fit_of : callable, FreeDecay -> Fit
        Under white noise, method ``waveform``.
    """
    decay, fit = _without_stray(decay, fit, fit_of)
    decay, fit = _without_lines(decay, fit, fit_of)
    return _with_its_zero(decay, fit, fit_of)


def plain_decay(decay: FreeDecay, fit: Fit) -> PlainDecay:
    """A decay with its fit under white noise, by method ``waveform``, as accounts are given it."""
    motion = fit.motion
    assert motion is not None
    return PlainDecay(
        values=decay.values,
        time=decay.time,
        order=decay.quantity.order,
        frequency=fit.frequency,
        coefficient=float(fit.coefficient.mean()),
        rest_position=fit.rest_position,
        states=motion.states,
        phase_sd=motion.phase_sd,
        rest_known=decay.rest_known,
        pendulum=swing_frequency(decay.system, decay.unit) > 0.0,
        noise_sd=fit.noise_sd,
    )


def _fitted(decay: FreeDecay, fit_of: Callable[[FreeDecay], Fit]) -> Fit | None:
    """The fit of what is left of a decay; None where that is no decay any more."""
    try:
        return fit_of(decay)
    except InputError:
        return None


def _without_stray(decay: FreeDecay, fit: Fit, fit_of: Callable[[FreeDecay], Fit]) -> tuple[FreeDecay, Fit]:
    """The decay without stray samples, and its fit."""
    for _ in range(_MOST_FITS):
        stray = _stray_of(decay, fit)
        without = decay.without_stray(stray)
        there = _fitted(without, fit_of) if stray.any() else None
        if there is None:
            break
        decay, fit = without, there
    return decay, fit


def _stray_of(decay: FreeDecay, fit: Fit) -> Mask:
    """Which samples of a decay are rather stray, shape (n,)."""
    if fit.prediction is None or fit.motion is None:
        return np.zeros(decay.values.size, np.bool_)
    rounded = _rounded_at_turns(decay, fit, fit.motion)
    return stray_samples(decay.values - fit.prediction, float(np.ptp(decay.values)), rounded)


def _rounded_at_turns(decay: FreeDecay, fit: Fit, motion: FittedMotion) -> Array | float:
    """By how much a filter may round what the sensor shows where the motion turns, shape (n,).

    An acceleration jumps there by that of twice the friction, and a velocity bends.
    """
    if decay.quantity.order == 0:
        return 0.0
    jump = 2.0 * abs(float(fit.coefficient.mean()))
    if decay.quantity.order == 1:
        jump *= fit.frequency * decay.step
    x, v = motion.states.T
    return np.where(np.abs(v) < _FROM_TURN * np.hypot(x, v), jump, 0.0)


def _without_lines(decay: FreeDecay, fit: Fit, fit_of: Callable[[FreeDecay], Fit]) -> tuple[FreeDecay, Fit]:
    """The decay less lines off the motion's harmonics, and its fit; less the strays that they hid."""
    with_them = decay
    lines: tuple[Line, ...] = ()
    for _ in range(_MOST_FITS):
        found = _more_lines(decay, fit, lines)
        if fit.prediction is None or not found:
            break
        lines = (*lines, *found)
        waves = np.column_stack([wave for line in lines for wave in line.waves(decay.time).values()])
        size = np.linalg.lstsq(waves, with_them.values - fit.prediction, rcond=None)[0]
        without = with_them.without_lines(waves @ size, _distinct(lines, decay.duration))
        there = _fitted(without, fit_of)
        if there is None:
            break
        decay, fit = without, there
    return _without_stray(decay, fit, fit_of) if lines else (decay, fit)


def _distinct(lines: Sequence[Line], duration: float) -> list[float]:
    """Frequencies of lines: one that dies out slowly is found as steady first, and as what is left of it."""
    found: list[float] = []
    for frequency in (line.frequency for line in lines):
        if all(abs(frequency - each) * duration >= LINES_APART for each in found):
            found.append(frequency)
    return found


def _more_lines(decay: FreeDecay, fit: Fit, known: Sequence[Line]) -> tuple[Line, ...]:
    """Lines in the residual of a fit, other than those known."""
    if fit.prediction is None:
        return ()
    residual, motion = decay.values - fit.prediction, fit.frequency / (2.0 * math.pi)
    search = LineSearch(decay.step, decay.duration, motion, lowest=_LOWEST * motion)
    even = decay.evenly(residual, decay.time)
    found = steady_lines([even], search, [line for line in known if line.steady])
    found += decaying_lines(even, search, [line for line in known if not line.steady])
    # what is higher than its surroundings alone, as in the quiet band of a filter, takes nothing away
    return tuple(line for line in found if search.shows(line, decay.time, residual))


def _with_its_zero(decay: FreeDecay, fit: Fit, fit_of: Callable[[FreeDecay], Fit]) -> tuple[FreeDecay, Fit]:
    """The decay and its fit, less a drift of the zero where the rest needs no random force.

    Where it does, as behind an AC coupling, a smooth curve is no better than what makes it.
    """
    drift = zero_drift(plain_decay(decay, fit))
    if drift is not None:
        without = decay.without_drift(drift)
        there = _fitted(without, fit_of)
        if there is not None and needs_no_force(plain_decay(without, there)):
            return without, there
    return decay, fit
