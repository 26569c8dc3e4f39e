"""A sensor that lags behind by a fixed amount on the way: an encoder's held count, backlash.

With backlash the reading waits after each turning point until the play, twice the lag, is taken up. Of plays
these two are evaluated, zero and twice the lag, and no third: the size of one has no spread.
"""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.mechanics.effects.effect import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import half_normal

__all__ = ["SENSOR_HYSTERESIS"]


def _distort(signal: Array, time: Array, half_width: float, play: float) -> Array:
    if play > 0.0:
        return signal - half_width * _side(signal, play)
    return signal - half_width * np.sign(np.gradient(signal, time))


@njit(**KERNEL)
def _side(signal: Array, play: float) -> Array:
    """On which side of the play the reading is, -1 to 1; it begins in the middle."""
    side = np.zeros_like(signal)
    for i in range(1, signal.size):
        side[i] = min(max(side[i - 1] + 2.0 * (signal[i] - signal[i - 1]) / play, -1.0), 1.0)
    return side


SENSOR_HYSTERESIS = SensorEffect(
    name="sensor_hysteresis",
    summary="- h sign v, which changes sides over a play p after each turning point",
    parameters=(
        Parameter(
            name="half_width",
            unit="signal",
            low=0.0,
            prior=lambda scales: half_normal(0.01 * scales.signal),
        ),
        Parameter(
            name="play",
            unit="signal",
            low=0.0,
            default=0.0,
            prior=lambda scales: half_normal(0.02 * scales.signal),
        ),
    ),
    distort=_distort,
    shapes=lambda half_width: ((0.0,), (2.0 * half_width,)),
    # it is the position that is held: an accelerometer has neither counts nor play
    quantities=("displacement", "angle"),
)
