"""A sensor whose zero is not the rest position."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["SENSOR_OFFSET"]


def _distort(signal: NDArray[np.float64], time: NDArray[np.float64], offset: float) -> NDArray[np.float64]:
    return signal + offset


SENSOR_OFFSET = SensorEffect(
    name="sensor_offset",
    summary="+ a",
    parameters=(Parameter(name="offset", unit="signal", prior=lambda scales: normal(0.1 * scales.signal)),),
    excludes=("sensor_drift",),
    distort=_distort,
)
