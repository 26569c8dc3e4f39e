"""A force that repeats with every turn of a rotor: unbalance, a bent shaft, cogging, a cord on its drum.

It depends on the angle alone: it takes no energy out of the motion, and bends its shape within each cycle. A
wheel out of balance has it once a turn, the others more often.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import Extent, ForceEffect
from friction_bayes.mechanics.effects.prior import Prior, Scales, normal
from friction_bayes.mechanics.effects.turn_series import TERMS, turn_parameters

__all__ = ["POSITION_FORCE"]


_NONE = 1e-8
"""Prior sd, over the spring's force, of a term that is not looked for."""


@njit(nogil=True)
def _force(
    t: float,
    x: float,
    v: float,
    direction: float,
    friction: float,
    duration: float,
    mass: float,
    stiffness: float,
    p: Array,
    i: int,
) -> float:
    once_sine, once_cosine = math.sin(x), math.cos(x)
    sine, cosine, force = 0.0, 1.0, 0.0
    for k in range(TERMS):
        # addition theorem
        sine, cosine = sine * once_cosine + cosine * once_sine, cosine * once_cosine - sine * once_sine
        force += p[i + 2 * k] * sine + p[i + 2 * k + 1] * cosine
    return force


def _prior(term: int, wave: str) -> Callable[[Scales], Prior]:
    def prior(scales: Scales) -> Prior:
        # the sine of once a turn is a pendulum's own restoring force, of which there is no more
        own = scales.system.pendulum and (term, wave) == (1, "sine")
        # a hundredth of the spring's force at the largest swing
        return normal((_NONE if own else 0.01) * scales.system.stiffness * scales.amplitude)

    return prior


POSITION_FORCE = ForceEffect(
    name="position_force",
    summary="sum a_n sin n x + b_n cos n x, n = 1 .. 4",
    parameters=turn_parameters(_prior, "N", "N m"),
    force=_force,
    resists=False,
    rotational=True,
    # within less than half a turn it is a spring that hardens or softens
    least_swing=0.5 * math.pi,
    series=(Extent(2), Extent(4), Extent(8)),
)
