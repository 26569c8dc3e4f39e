"""Friction that depends on the position, ``r (1 + a x + b x^2)``: ``r`` is that at the rest.

A guide that binds on one side, a weight that leaves its track at the ends of the swing. The slope takes no
energy out of a full cycle; the curvature takes as much as quadratic drag does, and differs from it by the
shape within a cycle.
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["POSITION_FRICTION"]


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
    return friction * direction * x * (p[i] + p[i + 1] * x)


POSITION_FRICTION = ForceEffect(
    name="position_friction",
    summary="r (1 + a x + b x^2)",
    # either may halve friction, or take it half as large again, at full amplitude
    parameters=(
        Parameter(
            name="slope",
            unit="1/m",
            angular_unit="1/rad",
            default=0.0,
            prior=lambda scales: normal(0.5 / scales.amplitude),
        ),
        Parameter(
            name="curvature",
            unit="1/m2",
            angular_unit="1/rad2",
            default=0.0,
            prior=lambda scales: normal(0.5 / scales.amplitude**2),
        ),
    ),
    force=_force,
    largest_swing=0.5 * math.pi,
)
