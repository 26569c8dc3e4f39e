r"""How strong the noise of the sensor is near the motion's frequency, and what colour it has above.

What lies far above the motion's frequency is no witness of friction: filters, means over intervals and
interpolation take the corners of the motion away together with the noise there, and the silence of that band
would speak against friction, or for a force in place of the noise. The noise is therefore taken to be nowhere
below its level ``sigma**2`` near the motion's frequency,

.. math:: S(\\omega) = \\max(S_r(\\omega), \\sigma^2) \\ (\\omega > 2 \\omega_0), \\quad \\sigma^2 \\ \\text{below},

with ``S_r`` the spectrum of an autoregression of the residual. The level is told by means of a tenth of a period, which
show nothing of what lies higher, and three ways: as the white noise that is most likely beside a random force,
whose mark is a resonance that no sensor has, and as the spectrum of the residual over the octave above the
motion's frequency, with that force in it and without. A force raises the first of these spectra and lowers the
second; noise that falls with frequency raises both, noise that rises lowers both. The median is right in all
three cases.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.block_means import block_means
from friction_bayes.estimators.random_force.coloured_noise import Autoregression, burg
from friction_bayes.estimators.random_force.smoothing import first_motion
from friction_bayes.estimators.random_force.whitening import Clock, sensor_row, shown

__all__ = ["SensorNoise", "sensor_noise"]

_PER_PERIOD = 10
"""Means a period: their Nyquist frequency is five times the motion's."""
_OCTAVE = np.geomspace(1.0, 2.0, 20)
"""Frequencies, over the motion's, at which a noise that rises with frequency is told."""


@dataclass(frozen=True)
class SensorNoise:
    """What a residual says of the noise that an estimator may count on.

    Attributes
    ----------
    floor : float
        Sd of white noise of the level near the motion's frequency.
    colour : Autoregression or None
        Of the noise; None where it is white.
    coloured_floor : float
        Least sd of noise of that colour, which has this level near the motion's frequency.
    """

    floor: float
    colour: Autoregression | None
    coloured_floor: float


def sensor_noise(
    residual: Array, phase: Array, order: int, fitted: int, *, least: float = 0.0, even: bool = True
) -> SensorNoise:
    """Noise of the sensor from what a fit leaves.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    phase : ndarray, shape (n,)
        Of the samples, ``w0 t``.
    order : int
        Order of the derivative measured.
    fitted : int
        How many numbers have been fitted to it.
    least : float
        Of which the floor is known to be, at least.
    even : bool
        Whether the samples are evenly spaced; without, no colour is looked for.
    """
    angle = float(phase[-1] - phase[0]) / (phase.size - 1)
    own, variance = burg(residual, fitted)
    block = max(int(2.0 * math.pi / angle / _PER_PERIOD), 1)
    # of a mean of a block to that of a sample
    floor2 = block * _level(block_means(residual, block), block_means(phase, block), order, fitted / block)
    if own.order == 0:
        floor2 = min(floor2, variance)
    floor2 = max(floor2, least**2)
    if own.order == 0 or not even:
        return SensorNoise(math.sqrt(floor2), None, math.sqrt(floor2))
    colour = own.tempered(floor2 / variance, angle, residual.size)
    level = colour.level(angle * _OCTAVE)
    return SensorNoise(math.sqrt(floor2), colour, math.sqrt(floor2 / level))


def _level(residual: Array, phase: Array, order: int, fitted: float) -> float:
    """Variance of the white noise that is as strong as the sensor's near the motion's frequency."""
    row, octave = sensor_row(order), _OCTAVE * float(phase[-1] - phase[0]) / (phase.size - 1)
    motion = first_motion(residual, Clock.of(phase), row)
    levels = [motion.noise**2]
    for left in (residual, residual - shown(motion.states, row)):
        colour, variance = burg(left, fitted)
        levels.append(variance * colour.level(octave))
    return float(np.median(levels))
