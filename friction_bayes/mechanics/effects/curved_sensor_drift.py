"""A sensor whose zero moves along a curve, as one does that warms up, or whose readings are integrated."""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["CURVED_SENSOR_DRIFT"]

_CHANGE = 0.1
"""Prior sd of each term at the end of the record, over the signal: that of a drift at a constant rate."""


def _distort(signal: Array, time: Array, offset: float, rate: float, curvature: float, cubic: float) -> Array:
    return signal + offset + time * (rate + time * (curvature + time * cubic))


CURVED_SENSOR_DRIFT = SensorEffect(
    name="curved_sensor_drift",
    summary="+ a + b t + c t^2 + d t^3",
    parameters=(
        Parameter(name="offset", unit="signal", default=0.0, prior=lambda scales: normal(scales.offset)),
        Parameter(
            name="rate",
            unit="signal/s",
            prior=lambda scales: normal(_CHANGE * scales.signal / scales.duration),
        ),
        Parameter(
            name="curvature",
            unit="signal/s2",
            prior=lambda scales: normal(_CHANGE * scales.signal / scales.duration**2),
        ),
        Parameter(
            name="cubic",
            unit="signal/s3",
            prior=lambda scales: normal(_CHANGE * scales.signal / scales.duration**3),
        ),
    ),
    excludes=(SENSOR_OFFSET.name, SENSOR_DRIFT.name),
    distort=_distort,
)
