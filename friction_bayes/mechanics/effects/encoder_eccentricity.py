"""An encoder that sits off its axis: it reads an angle wrong by an amount that repeats with every turn.

A disc off centre errs once a turn, a tilted or oval one twice; bearing and lines a little more often.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Extent, SensorEffect
from friction_bayes.mechanics.effects.prior import Prior, Scales, normal
from friction_bayes.mechanics.effects.turn_series import TERMS, turn_parameters

__all__ = ["ENCODER_ECCENTRICITY"]

_ONCE = 0.003
"""Prior sd of the error once a turn [rad]: a disc of 10 mm radius off centre by 0.03 mm."""
_MISPLACED = 10.0
"""So many times as much where a magnet before a chip, or a disc pushed on by hand, is 0.3 mm off."""


def _prior(n: int, wave: str) -> Callable[[Scales], Prior]:
    return lambda scales: normal(_ONCE / n)


def _distort(signal: Array, time: Array, *coefficients: float) -> Array:
    waves = ((n, wave) for n in range(1, TERMS + 1) for wave in (np.sin, np.cos))
    # most often one of them alone is asked for
    return signal + sum(a * wave(n * signal) for a, (n, wave) in zip(coefficients, waves, strict=True) if a)


ENCODER_ECCENTRICITY = SensorEffect(
    name="encoder_eccentricity",
    summary="+ sum a_n sin n x + b_n cos n x, n = 1 .. 4",
    parameters=turn_parameters(_prior, "signal"),
    distort=_distort,
    quantities=("angle",),
    # of the encoder, whatever the release
    per_record=False,
    # within less it is an offset, a gain and hardly a bent scale, which other laws imitate
    least_swing=0.5,
    # what is out of place errs once and twice a turn, not more often
    series=(Extent(4), Extent(8), Extent(4, _MISPLACED)),
)
