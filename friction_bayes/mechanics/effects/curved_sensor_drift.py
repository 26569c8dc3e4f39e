"""A sensor whose zero moves along a curve, as one does that warms up, or whose readings are integrated."""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["CURVED_SENSOR_DRIFT"]

_RATE = SENSOR_DRIFT.parameters[1]


def _distort(signal: Array, time: Array, offset: float, rate: float, curvature: float, cubic: float) -> Array:
    return signal + offset + time * (rate + time * (curvature + time * cubic))


CURVED_SENSOR_DRIFT = SensorEffect(
    name="curved_sensor_drift",
    summary="+ a + b t + c t^2 + d t^3",
    # each term may change as much over the record as that of the constant rate
    parameters=(
        *SENSOR_DRIFT.parameters,
        Parameter(
            name="curvature",
            unit="signal/s2",
            prior=lambda scales: normal(_RATE.prior(scales).scale / scales.duration),
        ),
        Parameter(
            name="cubic",
            unit="signal/s3",
            prior=lambda scales: normal(_RATE.prior(scales).scale / scales.duration**2),
        ),
    ),
    excludes=(SENSOR_OFFSET.name, SENSOR_DRIFT.name),
    distort=_distort,
)
