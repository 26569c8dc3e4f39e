"""Quadratic drag, ``b v |v|``: each half cycle loses ``(4/3) (b/m) A^2``."""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import Prior, Scales, half_normal

__all__ = ["QUADRATIC_DRAG"]


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
    return p[i] * v * v * direction


def _prior(scales: Scales) -> Prior:
    # the drag that takes from the largest half cycle what an e-fold of amplitude in the record takes
    damping_ratio = 1.0 / (scales.system.natural_frequency * scales.duration)
    return half_normal(damping_ratio * 0.75 * math.pi * scales.system.moving / scales.amplitude)


QUADRATIC_DRAG = ForceEffect(
    name="quadratic_drag",
    summary="b v |v|",
    parameters=(
        Parameter(name="drag_coefficient", unit="kg/m", angular_unit="kg m2", low=0.0, prior=_prior),
    ),
    force=_force,
)
