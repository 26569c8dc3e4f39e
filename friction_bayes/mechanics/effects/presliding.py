r"""Pre-sliding: after a turning point the contact springs back before it slides (P. Dahl, 1976).

Friction turns over a distance ``s`` from the turning point, ``r (1 - 2 exp(-s/s0))``, rather than at once. It
shortens the half period, the more the smaller the amplitude. It has no memory: the energy gives the distance,

.. math:: \tfrac12 m v^2 = \Big(k |x| + \tfrac12 k s - r + 2 r \frac{1 - e^{-s/s_0}}{s/s_0}\Big) s
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import half_normal

__all__ = ["PRESLIDING"]

_ROUNDS = 4
"""Of Newton's method for the distance, after which its error is rounding but at the edge of the dead band."""


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
    pull = stiffness * abs(x)
    # on the way out friction is fully turned; within the dead band the contact sticks; what pushes does not
    if p[i] <= 0.0 or x * direction >= 0.0 or pull <= friction or friction <= 0.0:
        return 0.0
    energy = 0.5 * mass * v * v / p[i]
    ratio = energy / (pull + friction)
    for _ in range(_ROUNDS):
        excess = (pull - friction + 0.5 * stiffness * p[i] * ratio) * ratio
        excess -= 2.0 * friction * math.expm1(-ratio) + energy
        ratio -= excess / (pull - friction + stiffness * p[i] * ratio + 2.0 * friction * math.exp(-ratio))
    return -2.0 * friction * direction * math.exp(-ratio)


PRESLIDING = ForceEffect(
    name="presliding",
    summary="r (1 - 2 exp(-s/s0)), s from the last turning point",
    parameters=(
        Parameter(
            name="displacement",
            unit="m",
            angular_unit="rad",
            low=0.0,
            prior=lambda scales: half_normal(0.02 * scales.amplitude),
        ),
    ),
    force=_force,
)
