"""A sensor whose zero moves at a constant rate."""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["SENSOR_DRIFT"]


def _distort(signal: Array, time: Array, offset: float, rate: float) -> Array:
    return signal + offset + rate * time


SENSOR_DRIFT = SensorEffect(
    name="sensor_drift",
    summary="+ a + b t",
    parameters=(
        Parameter(name="offset", unit="signal", default=0.0, prior=lambda scales: normal(scales.offset)),
        Parameter(
            name="rate",
            unit="signal/s",
            prior=lambda scales: normal(0.1 * scales.signal / scales.duration),
        ),
    ),
    excludes=("sensor_offset",),
    distort=_distort,
)
