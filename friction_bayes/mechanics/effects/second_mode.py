"""Another mode of the machine or of its mount that rings in addition to the motion and dies out.

What the sensor shows of it: the two modes are taken not to act on each other.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import Prior, Scales, log_normal, normal, uniform

__all__ = ["SECOND_MODE"]

_AT_FULL_SWING = 0.1
"""Prior sd of its sine and cosine at the beginning, over the largest signal."""


def _of_amplitude(scales: Scales) -> Prior:
    return normal(_AT_FULL_SWING * scales.signal)


def _distort(
    signal: Array, time: Array, sine: float, cosine: float, frequency: float, decay_time: float
) -> Array:
    angle = 2.0 * math.pi * frequency * time
    return signal + np.exp(-time / decay_time) * (sine * np.sin(angle) + cosine * np.cos(angle))


SECOND_MODE = SensorEffect(
    name="second_mode",
    summary="+ exp(-t/T) (a sin 2 pi f t + b cos 2 pi f t)",
    parameters=(
        Parameter(name="sine", unit="signal", prior=_of_amplitude),
        Parameter(name="cosine", unit="signal", default=0.0, prior=_of_amplitude),
        Parameter(
            name="frequency",
            unit="Hz",
            low=0.0,
            open_low=True,
            # with less than one period in the record it is a drift
            prior=lambda scales: uniform(1.0 / scales.duration, 0.5 * scales.sampling_rate),
        ),
        Parameter(
            name="decay_time",
            unit="s",
            low=0.0,
            open_low=True,
            prior=lambda scales: log_normal(0.1 * scales.duration, 1.0),
        ),
    ),
    distort=_distort,
)
