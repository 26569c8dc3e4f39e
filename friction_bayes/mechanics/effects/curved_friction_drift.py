"""Friction that changes over the record faster at one end, ``r (1 + e u + c (u^2 - 1/12))``, u = t/T - 1/2.

A contact that warms up or sheds its lubricant approaches a level, much as ``exp(-t/tau)`` does; two terms
follow that to a few hundredths of friction where ``tau`` is at least half the record. ``r`` is the mean. Each
record has a change of its own, see :mod:`friction_bayes.mechanics.effects.friction_drift`.
"""

from __future__ import annotations

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["CURVED_FRICTION_DRIFT"]


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
    u = t / duration - 0.5
    return friction * (p[i] * u + p[i + 1] * (u * u - 1.0 / 12.0)) * direction


def _later(values: tuple[float, ...], share: float) -> tuple[float, tuple[float, ...]]:
    slope, curvature = values
    level = 1.0 + slope * share + curvature * share**2
    return level, ((slope + 2.0 * curvature * share) / level, curvature / level)


CURVED_FRICTION_DRIFT = ForceEffect(
    name="curved_friction_drift",
    summary="r (1 + e u + c (u^2 - 1/12)), u = t/T - 1/2",
    parameters=(
        Parameter(
            name="relative_change", unit="1", low=-2.0, high=2.0, prior=lambda scales: normal(0.5, -2.0, 2.0)
        ),
        # exp(-t/T) has 0.5
        Parameter(
            name="curvature", unit="1", low=-6.0, high=6.0, prior=lambda scales: normal(1.0, -6.0, 6.0)
        ),
    ),
    excludes=(FRICTION_DRIFT.name,),
    per_record=True,
    force=_force,
    later=_later,
)
