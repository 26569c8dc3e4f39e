"""A sensor whose scale is bent, ``x + c x^2``: one side of the rest reads too long and the other too short.

Perspective of a camera, or a transducer off the middle of its range. A spring that is stiffer on one side
leaves another trace: for the same second harmonic the centre moves three times as far, and the other way.
"""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["SENSOR_NONLINEARITY"]

_AT_FULL_SWING = 0.02
"""Prior sd of the error at the largest signal, over it."""


def _distort(signal: Array, time: Array, curvature: float) -> Array:
    return signal + curvature * signal**2


SENSOR_NONLINEARITY = SensorEffect(
    name="sensor_nonlinearity",
    summary="+ c x^2",
    parameters=(
        Parameter(
            name="curvature", unit="1/(signal)", prior=lambda scales: normal(_AT_FULL_SWING / scales.signal)
        ),
    ),
    distort=_distort,
    # over a part of a turn the cosine of an eccentric encoder bends the scale too
    excludes=("encoder_eccentricity",),
    linear=True,
    # of the sensor, whatever the release
    per_record=False,
)
