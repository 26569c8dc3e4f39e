r"""The level of the sensor noise near the motion's frequency, and its colour above.

The band far above the motion's frequency is no evidence about friction: filters, means over intervals and
interpolation remove the corners of the motion together with the noise there, and a quiet band would count as
evidence against friction, or for a force in place of the noise. Coloured noise is therefore nowhere
below its level ``sigma**2`` near the motion's frequency,

.. math:: S(\omega) = \max(S_r(\omega), \sigma^2) \ (\omega > 2 \omega_0), \quad \sigma^2 \ \text{else},

with ``S_r`` the spectrum of an autoregression of the residual. The level is computed from means of a sixth of
a period, which filter out what lies higher, in three ways: as the white noise averaged over models with and
without a random force (which shows as a resonance that no sensor has), and as the spectrum of the residual
over the octave above the motion's frequency, with that force in it and without. A force raises the first of
these spectra and lowers the second; noise that falls with frequency raises both, noise that rises lowers
both. The median is right in all three cases.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.decay.block_means import block_means
from friction_bayes.estimators.noise.force_screen import (
    ComparedForces,
    force_table,
    probability_of_none,
)
from friction_bayes.estimators.noise.recording_filters import RecordingFilter
from friction_bayes.statespace.coloured_noise import Autoregression, burg
from friction_bayes.statespace.force_prior import at_resonance
from friction_bayes.statespace.kalman import Clock, sensor_row, shown, smooth, whiten
from friction_bayes.statespace.response import at_sensor
from friction_bayes.statespace.transition import initial_response

__all__ = [
    "RATHER_NONE",
    "SensorNoise",
    "compared_forces",
    "looks_white",
    "noise_floor",
    "own_colour",
    "samples_in_mean",
    "samples_of_colour",
    "sensor_noise",
]

_PER_PERIOD = 6
"""Means a period: their Nyquist frequency is three times the motion's."""
_COLOUR_PER_PERIOD = 12
"""Means a period in which noise is looked for that is stronger near the motion's frequency. Of white records
of fifty periods 4e-4 fail by it, where 6e-4 do by six means; noise that is correlated over up to half a
period is found as often or more often."""
_SIZES = np.geomspace(0.1, 100.0, 7)
_TIMES = (0.3, 1.0, 3.0, 10.0)
"""Of forces that the level is averaged over: sd at resonance over the noise, correlation times as phases."""
_FEWEST_MEANS = 2 * _PER_PERIOD
"""In two periods: fewer say nothing about a force, and the residual's own size is used."""
_PRIOR_NONE = 0.5
"""Prior probability of none in that average."""
RATHER_NONE = 0.75
"""Probability of none from which on a quick test passes white noise.

Of records under a force of a tenth of friction, 200 and 100 samples long, batches cover 70 and 75 % with 0.5,
80 and 78 % with 0.75, 85 and 78 % with 0.85, and 95 and 78 % one by one; of those without a force 1, 2 and 5
of 80 take the long way.
"""
_OCTAVE = np.geomspace(1.0, 2.0, 20)
"""Frequencies, over the motion's, at which noise that rises with frequency is evaluated."""


@dataclass(frozen=True)
class SensorNoise:
    """The least noise that an estimator may assume.

    Attributes
    ----------
    colour : Autoregression or None
        Of the noise; None where it is white.
    coloured_floor : float
        Least sd of noise of that colour, which has this level near the motion's frequency.
    weaker_above : bool
        Whether the residual is weaker than white noise of that level, as behind a filter.
    """

    colour: Autoregression | None
    coloured_floor: float
    weaker_above: bool


@cache
def compared_forces() -> ComparedForces:
    """The forces that the level is averaged over, none first."""
    forces = [(0.0, 1.0), *((size / float(at_resonance(tau)), tau) for size in _SIZES for tau in _TIMES)]
    ratio, tau = np.array(forces).T
    each = (1.0 - _PRIOR_NONE) / (len(forces) - 1)
    log_prior = np.log(np.where(ratio > 0.0, each, _PRIOR_NONE))
    return ComparedForces(np.ascontiguousarray(ratio), np.ascontiguousarray(tau), log_prior)


def noise_floor(
    residual: Array, phase: Array, order: int, fitted: int, filter_: RecordingFilter | None = None
) -> float:
    """Sd of white noise of the sensor's level near the motion's frequency, from the residual of a fit.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    phase : ndarray, shape (n,)
        Of the samples, ``w0 t``.
    order : int
        Order of the derivative measured.
    fitted : int
        How many numbers have been fitted to it.
    filter_ : RecordingFilter or None
        Between the law and the residual: what is fitted there varies little within a mean, and all of it is
        of the means; without one, some of it is of the corners, as is a force.
    """
    if filter_ is not None:
        residual = filter_.gain * filter_.undone(residual)
    own, variance = burg(residual, fitted)
    block = samples_in_mean(_angle(phase))
    if residual.size < _FEWEST_MEANS * block:
        return math.sqrt(variance)
    # of a mean of a block to that of a sample
    spent = fitted / block if filter_ is None else fitted
    level = block * _level(block_means(residual, block), block_means(phase, block), order, spent)
    return math.sqrt(min(level, variance) if own.order == 0 else level)


def sensor_noise(residual: Array, phase: Array, fitted: int, floor: float, *, even: bool) -> SensorNoise:
    """Noise of that floor with the colour of a fit's residual.

    Parameters
    ----------
    residual, phase, fitted
        As for :func:`noise_floor`.
    floor : float
        From there.
    even : bool
        Whether the samples are evenly spaced; without, no colour is looked for.
    """
    own, variance = burg(residual, fitted)
    white = SensorNoise(None, floor, weaker_above=own.order > 0 and floor**2 > variance)
    if own.order == 0 or not even:
        return white
    angle = _angle(phase)
    colour = own.levelled(floor**2 / variance, angle, floor**2 / variance)
    if colour.gain(residual.size) <= colour.penalty:
        return white
    return replace(white, colour=colour, coloured_floor=floor / math.sqrt(colour.level(angle * _OCTAVE)))


def own_colour(residual: Array, phase: Array, fitted: int) -> Autoregression | None:
    """Colour of the residual of a fit at even samples, level near the motion's frequency; None where white.

    No sensor has a resonance there: a force has. Parameters as for :func:`noise_floor`.
    """
    own, _ = burg(residual, fitted)
    if own.order == 0:
        return None
    angle = _angle(phase)
    return own.levelled(own.level(angle * _OCTAVE), angle)


def _angle(phase: Array) -> float:
    """Phase from one sample to the next, on average."""
    return float(phase[-1] - phase[0]) / (phase.size - 1)


@njit(**KERNEL)
def samples_in_mean(angle: float) -> int:
    """Number of samples, ``angle`` apart in phase, averaged into one."""
    return max(int(2.0 * math.pi / angle / _PER_PERIOD), 1)


@njit(**KERNEL)
def samples_of_colour(angle: float) -> int:
    """Number of samples, ``angle`` apart in phase, in a mean in which noise of a colour is looked for."""
    return max(int(2.0 * math.pi / angle / _COLOUR_PER_PERIOD), 1)


def looks_white(residual: Array, phase: Array, order: int, fitted: int) -> bool:
    """Whether a residual shows neither coloured noise nor a force: a quick test before the long one.

    Parameters as for :func:`noise_floor`, of even samples. The autoregressions of the samples and of means of
    a twelfth of a period are of order zero by their criterion, and there is rather no force.
    """
    angle = _angle(phase)
    for block in {1, samples_of_colour(angle)}:
        if burg(block_means(residual, block), fitted / block)[0].order:
            return False
    block, forces, row = samples_in_mean(angle), compared_forces(), sensor_row(order)
    thinned = block_means(residual, block)
    table = force_table(angle * block, thinned.size, row, order, forces)
    return float(probability_of_none(thinned, row, forces, table)) >= RATHER_NONE


class _WithForces(NamedTuple):
    """By a grid of forces on a residual: mean variance of the white noise, and what is left."""

    variance: float
    left: Array


def _level(residual: Array, phase: Array, order: int, fitted: float) -> float:
    """Variance of the white noise that is as strong as the sensor's near the motion's frequency."""
    octave = _OCTAVE * float(phase[-1] - phase[0]) / (phase.size - 1)
    found = _with_forces(residual, Clock.of(phase), sensor_row(order))
    levels = [found.variance]
    for each in (residual, found.left):
        colour, variance = burg(each, fitted)
        levels.append(variance * colour.level(octave))
    return float(np.median(levels))


def _with_forces(residual: Array, clock: Clock, row: Array) -> _WithForces:
    """Average over a grid of forces, no force included."""
    start = at_sensor(initial_response(clock.phase), row)
    columns = np.column_stack([start, np.ones(residual.size), residual])
    freedom = residual.size - columns.shape[1] + 1
    forces = compared_forces()
    laws, variances, log_weights = [], [], []
    for ratio, tau, log_prior in zip(*(each.tolist() for each in forces), strict=True):
        whitened = whiten(columns, clock, row, ratio, tau)
        scale = np.sqrt(np.diag(whitened.gram))
        lower = np.linalg.cholesky(whitened.gram / np.outer(scale, scale))
        pivots = np.log(np.diag(lower) * scale)
        laws.append(np.linalg.solve(lower[:-1, :-1].T, lower[-1, :-1]) * scale[-1] / scale[:-1])
        variances.append(math.exp(2.0 * pivots[-1]) / freedom)
        log_weight = -freedom * pivots[-1] - pivots[:-1].sum() - 0.5 * whitened.log_determinant
        log_weights.append(log_weight + log_prior)
    weight = np.exp(log_weights - logsumexp(log_weights))
    best = int(np.argmax(weight))
    left = residual - columns[:, :-1] @ laws[best]
    if best > 0:
        states, _ = smooth(left[:, None], clock, row, float(forces.ratio[best]), float(forces.tau[best]))
        left = left - shown(states[:, :3, 0], row)
    return _WithForces(float(weight @ variances), left)
