"""Drag between viscous and quadratic, ``c |v|^(3/2)``: a half cycle loses ``1.44 (c/m) w0^(-1/2) A^(3/2)``.

At Reynolds numbers of some 1 to 1000 (Allen's regime) the drag coefficient of a body falls with the root of
its speed, so that the force grows with the power 3/2.
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import Prior, Scales, half_normal

__all__ = ["INTERMEDIATE_DRAG"]

_WORK = math.sqrt(math.pi) * math.gamma(1.75) / math.gamma(2.25)
"""Integral of ``sin**2.5`` over a half cycle: the work of the force over ``c w0**1.5 A**2.5``."""


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
    return p[i] * abs(v) ** 1.5 * direction


def _prior(scales: Scales) -> Prior:
    # the drag that takes from the largest half cycle what an e-fold of amplitude in the record takes
    damping_ratio = 1.0 / (scales.system.natural_frequency * scales.duration)
    moving, root = scales.system.moving, math.sqrt(scales.system.natural_frequency / scales.amplitude)
    return half_normal(damping_ratio * math.pi * moving * root / _WORK)


INTERMEDIATE_DRAG = ForceEffect(
    name="intermediate_drag",
    summary="c |v|^(3/2) sign v",
    parameters=(
        Parameter(name="coefficient", unit="kg/(m s)^0.5", angular_unit="kg m2/s^0.5", low=0.0, prior=_prior),
    ),
    force=_force,
)
