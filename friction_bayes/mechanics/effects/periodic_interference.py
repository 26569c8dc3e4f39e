"""A steady tone picked up by the sensor, ``A sin(2 pi f t + p)``."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import half_normal, uniform

__all__ = ["PERIODIC_INTERFERENCE"]


def _distort(signal: Array, time: Array, amplitude: float, frequency: float, phase: float) -> Array:
    return signal + amplitude * np.sin(2.0 * math.pi * frequency * time + phase)


PERIODIC_INTERFERENCE = SensorEffect(
    name="periodic_interference",
    summary="+ A sin(2 pi f t + p)",
    parameters=(
        Parameter(
            name="amplitude", unit="signal", low=0.0, prior=lambda scales: half_normal(0.1 * scales.signal)
        ),
        Parameter(
            name="frequency",
            unit="Hz",
            low=0.0,
            open_low=True,
            # with less than one period in the record it is a drift
            prior=lambda scales: uniform(1.0 / scales.duration, 0.5 * scales.sampling_rate),
        ),
        Parameter(name="phase", unit="rad", default=0.0, prior=lambda scales: uniform(-math.pi, math.pi)),
    ),
    distort=_distort,
)
