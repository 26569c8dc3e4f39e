"""Friction that differs between the directions, ``r (1 + e sign v)``: exactly a constant force ``r e``."""

from __future__ import annotations

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["ASYMMETRIC_FRICTION"]


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
    # r e sign(v)^2: the same in either direction, also where the direction is known as an expectation alone
    return friction * p[i]


ASYMMETRIC_FRICTION = ForceEffect(
    name="asymmetric_friction",
    summary="r (1 + e sign v)",
    parameters=(
        Parameter(
            name="asymmetry", unit="1", low=-1.0, high=1.0, prior=lambda scales: normal(0.3, -1.0, 1.0)
        ),
    ),
    force=_force,
)
