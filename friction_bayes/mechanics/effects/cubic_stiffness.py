"""A spring that hardens or softens, ``k3 x^3``: the half period follows the amplitude squared."""

from __future__ import annotations

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["CUBIC_STIFFNESS"]


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
    return p[i] * x * x * x


CUBIC_STIFFNESS = ForceEffect(
    name="cubic_stiffness",
    summary="k3 x^3",
    parameters=(
        Parameter(
            name="cubic_stiffness",
            unit="N/m3",
            angular_unit="N m/rad3",
            # at the largest displacement a fifth of the linear spring's force
            prior=lambda scales: normal(0.2 * scales.system.stiffness / scales.amplitude**2),
        ),
    ),
    force=_force,
    resists=False,
)
