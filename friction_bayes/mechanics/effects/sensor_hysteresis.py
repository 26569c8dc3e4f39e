"""A sensor that lags behind by a fixed amount on the way: an encoder's held count, backlash."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import half_normal

__all__ = ["SENSOR_HYSTERESIS"]


def _distort(signal: Array, time: Array, half_width: float) -> Array:
    return signal - half_width * np.sign(np.gradient(signal, time))


SENSOR_HYSTERESIS = SensorEffect(
    name="sensor_hysteresis",
    summary="- h sign v",
    parameters=(
        Parameter(
            name="half_width",
            unit="signal",
            low=0.0,
            prior=lambda scales: half_normal(0.01 * scales.signal),
        ),
    ),
    distort=_distort,
    linear=True,
    search="if named",
    # it is the position that is held: an accelerometer has neither counts nor play
    quantities=("displacement", "angle"),
)
