"""An encoder that sits off its axis: it reads an angle wrong by an amount that repeats with every turn.

A disc off centre errs once a turn, a tilted or oval one twice.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import Prior, Scales, normal

__all__ = ["ENCODER_ECCENTRICITY"]


def _prior(scales: Scales) -> Prior:
    # a disc of 10 mm radius three hundredths of a millimetre off centre
    return normal(0.003)


def _distort(
    signal: Array, time: Array, once_sine: float, once_cosine: float, twice_sine: float, twice_cosine: float
) -> Array:
    once = once_sine * np.sin(signal) + once_cosine * np.cos(signal)
    return signal + once + twice_sine * np.sin(2.0 * signal) + twice_cosine * np.cos(2.0 * signal)


ENCODER_ECCENTRICITY = SensorEffect(
    name="encoder_eccentricity",
    summary="+ a sin x + b cos x + c sin 2x + d cos 2x",
    parameters=tuple(
        Parameter(name=name, unit="signal", default=0.0, prior=_prior)
        for name in ("once_sine", "once_cosine", "twice_sine", "twice_cosine")
    ),
    distort=_distort,
    quantities=("angle",),
    # within less than half a turn it is offset, gain and a bent scale, which other laws imitate
    least_swing=0.5 * math.pi,
)
