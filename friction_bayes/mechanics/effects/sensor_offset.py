"""A sensor whose zero is not the rest position."""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["SENSOR_OFFSET"]


def _distort(signal: Array, time: Array, offset: float) -> Array:
    return signal + offset


SENSOR_OFFSET = SensorEffect(
    name="sensor_offset",
    summary="+ a",
    parameters=(Parameter(name="offset", unit="signal", prior=lambda scales: normal(scales.offset)),),
    excludes=("sensor_drift",),
    distort=_distort,
)
