"""Viscous damping, ``2 zeta w0 m v``: each half cycle loses ``pi zeta A`` of its amplitude."""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import Prior, Scales, half_normal

__all__ = ["VISCOUS_DAMPING"]


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
    return 2.0 * p[i] * math.sqrt(stiffness * mass) * v


def _prior(scales: Scales) -> Prior:
    # damping that takes an e-fold of the amplitude within the record: with more, there would be no record
    return half_normal(1.0 / (scales.system.natural_frequency * scales.duration))


VISCOUS_DAMPING = ForceEffect(
    name="viscous_damping",
    summary="2 zeta w0 m v",
    parameters=(Parameter(name="damping_ratio", unit="1", low=0.0, prior=_prior),),
    force=_force,
)
