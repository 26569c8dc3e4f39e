"""Friction that changes over the record, ``r (1 + e (t/T - 1/2))``; ``r`` is its mean.

Each record has a change of its own: what began anew with every release and went the same way in all of them
would be a law of the motion and no drift in time.
"""

from __future__ import annotations

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["FRICTION_DRIFT"]


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
    return friction * p[i] * (t / duration - 0.5) * direction


FRICTION_DRIFT = ForceEffect(
    name="friction_drift",
    summary="r (1 + e (t/T - 1/2))",
    parameters=(
        Parameter(
            name="relative_change", unit="1", low=-2.0, high=2.0, prior=lambda scales: normal(0.5, -2.0, 2.0)
        ),
    ),
    excludes=("curved_friction_drift",),
    per_record=True,
    force=_force,
)
