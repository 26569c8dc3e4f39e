r"""Pre-sliding: after a turning point the contact springs back before it slides (P. Dahl, 1976).

Friction turns over a distance ``s`` from the turning point, ``r (1 - 2 exp(-s/s0))``, rather than at once. It
shortens the half period, the more the smaller the amplitude. It has no memory: the energy gives the distance,

.. math:: \tfrac12 m v^2 = \Big(k \xi + \tfrac12 k s - r + 2 r \frac{1 - e^{-s/s_0}}{s/s_0}\Big) s

with the displacement ``xi`` on the side that the motion comes from, negative once it has passed the centre.
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import half_normal

__all__ = ["PRESLIDING"]

_ROUNDS = 5
"""Of Newton's method: the force is exact to 1e-9 of friction then, and next to the dead band to 1e-4."""
_TURNED = 40.0
"""Distance over ``s0`` from which on friction is fully turned, to rounding."""


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
    pull = -stiffness * x * direction
    # at rest within the dead band the contact sticks; what pushes does not
    if p[i] <= 0.0 or friction <= 0.0 or (v == 0.0 and abs(pull) <= friction):
        return 0.0
    # in units of s0, between what friction that never turns and friction that turned at once would have made
    energy, spring = 0.5 * mass * v * v / p[i], stiffness * p[i]
    low, high = _distance(pull + friction, energy, spring), _distance(pull - friction, energy, spring)
    # no motion begins within the dead band
    low = max(low, (friction - pull) / spring)
    if low > _TURNED:
        return 0.0
    ratio = low
    for _ in range(_ROUNDS):
        turned = math.exp(-ratio)
        excess = (pull - friction + 0.5 * spring * ratio) * ratio + 2.0 * friction * (1.0 - turned) - energy
        slope = pull - friction + spring * ratio + 2.0 * friction * turned
        ratio = min(max(ratio - excess / slope, low), high)
    return -2.0 * friction * direction * math.exp(-ratio)


@njit(nogil=True)
def _distance(force: float, energy: float, spring: float) -> float:
    """Positive root of ``(force + spring s / 2) s = energy``."""
    root = math.sqrt(force * force + 2.0 * spring * energy)
    return 2.0 * energy / (force + root) if force > 0.0 else (root - force) / spring


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
