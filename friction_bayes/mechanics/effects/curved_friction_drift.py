r"""Friction that changes over the record faster at one end, with ``u = t/T - 1/2``,

.. math:: r\,(1 + e u + c (u^2 - \tfrac{1}{12}) + g (u^3 - \tfrac{3}{20} u)).

A contact that runs in, warms up or sheds its lubricant approaches a level, much as ``exp(-t/tau)`` does;
three terms follow that to a hundredth of its change where ``tau`` is at least a third of the record. ``r`` is
the mean. Each record has a change of its own, see :mod:`friction_bayes.mechanics.effects.friction_drift`.
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
    change = p[i] * u + p[i + 1] * (u * u - 1.0 / 12.0) + p[i + 2] * (u * u - 0.15) * u
    return friction * change * direction


def _later(values: tuple[float, ...], share: float) -> tuple[float, tuple[float, ...]]:
    slope, curvature, cubic = values
    level = 1.0 + slope * share + curvature * share**2 + cubic * (share**3 + 0.1 * share)
    slope += 2.0 * curvature * share + 3.0 * cubic * share**2
    curvature += 3.0 * cubic * share
    return level, (slope / level, curvature / level, cubic / level)


CURVED_FRICTION_DRIFT = ForceEffect(
    name="curved_friction_drift",
    summary="r (1 + e u + c (u^2 - 1/12) + g (u^3 - 3 u/20)), u = t/T - 1/2",
    parameters=(
        Parameter(
            name="relative_change", unit="1", low=-2.0, high=2.0, prior=lambda scales: normal(0.5, -2.0, 2.0)
        ),
        # over its change exp(-t/tau) has 0.5 and 0.2 where tau is the record, 1.3 and 1.4 where it is a third
        Parameter(
            name="curvature", unit="1", low=-6.0, high=6.0, prior=lambda scales: normal(1.0, -6.0, 6.0)
        ),
        Parameter(
            name="cubic_change",
            unit="1",
            low=-6.0,
            high=6.0,
            default=0.0,
            prior=lambda scales: normal(1.0, -6.0, 6.0),
        ),
    ),
    excludes=(FRICTION_DRIFT.name,),
    per_record=True,
    force=_force,
    later=_later,
)
