"""Friction that is higher at low speed, ``r (1 + x exp(-(v/vs)^2))``; ``r`` is its high-speed level."""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import half_normal, log_normal

__all__ = ["STRIBECK_FRICTION"]


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
    if p[i] == 0.0:
        return 0.0
    relative_speed = v / p[i + 1]
    return friction * p[i] * math.exp(-relative_speed * relative_speed) * direction


STRIBECK_FRICTION = ForceEffect(
    name="stribeck_friction",
    summary="r (1 + x exp(-(v/vs)^2))",
    parameters=(
        Parameter(name="static_excess", unit="1", low=0.0, prior=lambda scales: half_normal(1.0)),
        Parameter(
            name="stribeck_velocity",
            unit="m/s",
            angular_unit="rad/s",
            low=0.0,
            open_low=True,
            prior=lambda scales: log_normal(0.1 * scales.velocity, 1.0),
        ),
    ),
    force=_force,
)
