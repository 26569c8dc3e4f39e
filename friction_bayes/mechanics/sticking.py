"""A system at rest: whether it sticks, and when it sets off again."""

from __future__ import annotations

from typing import NamedTuple

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER_OF_A_FUNCTION, njit
from friction_bayes.mechanics.dormand_prince import acceleration

__all__ = ["SampledMotion", "departure", "rest"]


class SampledMotion(NamedTuple):
    """Sample times, and the motion at them, filled as it goes on; no accelerations where none are wanted."""

    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array


@njit(**INNER_OF_A_FUNCTION)
def departure(force, law, p, t, x):  # type: ignore[no-untyped-def]
    """Direction in which a system at rest sets off, 0 when it sticks.

    It moves in a direction only if the acceleration under the friction of that very direction points there.
    """
    forward = acceleration(force, law, p, t, x, 0.0, 1.0)
    backward = acceleration(force, law, p, t, x, 0.0, -1.0)
    if forward > 0.0 and forward >= -backward:
        return 1.0
    if backward < 0.0:
        return -1.0
    return 0.0


@njit(**INNER_OF_A_FUNCTION)
def _break_away(force, law, p, still, moved, x):  # type: ignore[no-untyped-def]
    """Time between ``still`` and ``moved`` at which a sticking system sets off, by bisection to rounding."""
    while True:
        middle = 0.5 * (still + moved)
        if not still < middle < moved:
            return moved
        if departure(force, law, p, middle, x) != 0.0:
            moved = middle
        else:
            still = middle


@njit(**INNER_OF_A_FUNCTION)
def rest(force, law, p, samples, t, x, j):  # type: ignore[no-untyped-def]
    """Stick at ``x`` from sample ``j`` on, and fill the samples.

    Returns
    -------
    t : float
        When it breaks away.
    j : int
        The first sample after that, or the number of samples.
    direction : float
        In which it sets off; 0 when it never does.
    """
    while j < samples.time.size:
        due = samples.time[j]
        if due > t:
            direction = departure(force, law, p, due, x)
            if direction != 0.0:
                return _break_away(force, law, p, t, due, x), j, direction
            t = due
        samples.displacement[j] = x
        samples.velocity[j] = 0.0
        if samples.acceleration.size > 0:
            samples.acceleration[j] = 0.0
        j += 1
    return t, j, 0.0
