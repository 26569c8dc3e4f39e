"""A spring whose stiffness changes over the record, ``k (1 + e (t/T - 1/2))``; ``k`` is its mean.

A spring that warms up, a clamp that settles: the period follows the time and not the amplitude. Each record
has a change of its own, as what began anew with every release would be a law of the motion. Of a pendulum the
change acts on the angle, not on its sine.
"""

from __future__ import annotations

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.prior import normal

__all__ = ["STIFFNESS_DRIFT"]


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
    return stiffness * p[i] * (t / duration - 0.5) * x


STIFFNESS_DRIFT = ForceEffect(
    name="stiffness_drift",
    summary="k (1 + e (t/T - 1/2))",
    parameters=(
        Parameter(
            name="relative_change",
            unit="1",
            low=-1.0,
            high=1.0,
            # steel loses a hundredth of its stiffness in about 30 K
            prior=lambda scales: normal(0.01, -1.0, 1.0),
        ),
    ),
    per_record=True,
    force=_force,
    resists=False,
)
