r"""Friction that approaches a level over the record, as a contact does that runs in, warms up or dries.

.. math:: r\,(1 + e\,(g(t) - \bar g)), \qquad g(t) = \frac{1 - e^{-t/(\tau T)}}{1 - e^{-1/\tau}}

with ``r`` the mean over the record of length ``T``, over which friction changes by ``e``; ``tau`` is the time
in which it approaches, over ``T``. Each record has a change of its own, see
:mod:`friction_bayes.mechanics.effects.friction_drift`.
"""

from __future__ import annotations

import math

from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import ForceEffect, Parameter
from friction_bayes.mechanics.effects.friction_drift import FRICTION_DRIFT
from friction_bayes.mechanics.effects.prior import log_normal, normal

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
    if p[i] == 0.0:
        return 0.0
    rate = 1.0 / p[i + 1]
    whole = -math.expm1(-rate)
    gone = -math.expm1(-rate * t / duration)
    # of a slow one a difference of nearly equal numbers
    mean = 1.0 - whole / rate if rate > 1e-3 else rate * (0.5 - rate * (1.0 / 6.0 - rate / 24.0))
    return friction * p[i] * (gone - mean) / whole * direction


CURVED_FRICTION_DRIFT = ForceEffect(
    name="curved_friction_drift",
    summary="r (1 + e (g - mean of g)), g = (1 - exp(-t/(tau T))) / (1 - exp(-1/tau))",
    parameters=(
        Parameter(
            name="relative_change", unit="1", low=-2.0, high=2.0, prior=lambda scales: normal(0.5, -2.0, 2.0)
        ),
        # much longer than the record it is a drift along a line
        Parameter(
            name="time_share",
            unit="1",
            low=0.0,
            open_low=True,
            prior=lambda scales: log_normal(0.3, 1.0),
        ),
    ),
    excludes=(FRICTION_DRIFT.name,),
    per_record=True,
    force=_force,
)
