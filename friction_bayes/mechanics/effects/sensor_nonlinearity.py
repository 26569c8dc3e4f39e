"""A sensor whose scale is bent, ``x + c x^2 + e x^3``.

By ``c`` one side of the rest reads too long and the other too short, by ``e`` both sides alike: perspective
of a camera, or a transducer off the middle of its range, or near the ends of it. A spring that is stiffer
on one side leaves another trace than ``c``: for the same second harmonic the centre moves three times as
far, and the other way. With ``e`` the scale changes with the swing, and a third harmonic comes with that.
"""

from __future__ import annotations

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Extent, Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["SENSOR_NONLINEARITY"]

_AT_FULL_SWING = 0.02
"""Prior sd of each error at the largest signal, over it."""
_NEAR_THE_ENDS = 10.0
"""How many times as wide the priors are of a sensor near the ends of its range, which bends by a fifth."""


def _distort(signal: Array, time: Array, curvature: float, cubic: float) -> Array:
    return signal + signal**2 * (curvature + cubic * signal)


SENSOR_NONLINEARITY = SensorEffect(
    name="sensor_nonlinearity",
    summary="+ c x^2 + e x^3",
    parameters=(
        Parameter(
            name="curvature",
            unit="1/(signal)",
            default=0.0,
            prior=lambda scales: normal(_AT_FULL_SWING / scales.signal),
        ),
        Parameter(
            name="cubic",
            unit="1/(signal)2",
            default=0.0,
            prior=lambda scales: normal(_AT_FULL_SWING / scales.signal**2),
        ),
    ),
    distort=_distort,
    # over a part of a turn the cosine of an eccentric encoder bends the scale too
    excludes=("encoder_eccentricity",),
    # of the sensor, whatever the release
    per_record=False,
    series=(Extent(1), Extent(2), Extent(1, _NEAR_THE_ENDS), Extent(2, _NEAR_THE_ENDS)),
)
