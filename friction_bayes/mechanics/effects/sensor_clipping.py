"""A sensor that shows nothing beyond a level: flat tops at ``+-level``."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import log_normal

__all__ = ["SENSOR_CLIPPING"]


def _distort(signal: Array, time: Array, level: float) -> Array:
    return np.clip(signal, -level, level)


SENSOR_CLIPPING = SensorEffect(
    name="sensor_clipping",
    summary="flat beyond +-level",
    parameters=(
        Parameter(
            name="level",
            unit="signal",
            low=0.0,
            open_low=True,
            prior=lambda scales: log_normal(scales.signal, 0.5),
        ),
    ),
    distort=_distort,
    after_noise=True,
)
