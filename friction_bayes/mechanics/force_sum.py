"""The sum of the effects' forces and its partial derivatives, each compiled into one function."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from numba import njit
from numba.cpython.unsafe.tuple import tuple_setitem
from numba.extending import register_jitable

from friction_bayes.mechanics.effects import ForceEffect
from friction_bayes.mechanics.sensitivities import (
    DISPLACEMENT,
    FRICTION,
    MASS,
    OWN,
    PARAMETER_STEP,
    STIFFNESS,
    VELOCITY,
    Partials,
)

__all__ = ["total_force", "total_partials"]

_with_item: Callable[..., Any] = tuple_setitem
"""Takes a tuple, a place and the value to put there; numba hands in what else its type says it needs."""


@lru_cache(maxsize=16)
def total_force(effects: tuple[ForceEffect, ...]) -> Callable[..., float]:
    """Compile the sum of the effects' forces, each reading its own stretch of the parameters, a tuple.

    Written into one function: calls, eight deep, took two thirds of the time of an integration. What has no
    parameter but zeros is left out as it runs: most effects are absent from most motions, and every stage of
    a step waits for the sum. Of an array numba would count the references at each of these branches.
    """

    @njit(nogil=True, inline="always")
    def none(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        return 0.0

    total: Callable[..., float] = none
    offset = 0
    for effect in effects:
        end = offset + len(effect.parameters)
        total = _plus(total, effect.force, offset, end)
        offset = end

    # what is handed to kernels that are kept on disk must be a plain function
    @register_jitable
    def force(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        return total(t, x, v, direction, friction, duration, mass, stiffness, p)

    return force


def _plus(
    first: Callable[..., float], force: Callable[..., float], offset: int, end: int
) -> Callable[..., float]:
    # an effect's force is compiled by whoever wrote it: written into a sum, it is taken from its source
    second = njit(nogil=True, inline="always")(getattr(force, "py_func", force))

    @njit(nogil=True, inline="always")
    def both(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        total = first(t, x, v, direction, friction, duration, mass, stiffness, p)
        acts = False
        for k in range(offset, end):
            acts |= p[k] != 0.0
        if acts:
            total += second(t, x, v, direction, friction, duration, mass, stiffness, p, offset)
        return total

    return both


@lru_cache(maxsize=16)
def total_partials(effects: tuple[ForceEffect, ...]) -> Partials:
    """Compile the partial derivatives of that sum, by central differences of each effect's force alone."""

    @njit(nogil=True, inline="always")
    def still(t, x, v, direction, friction, duration, mass, stiffness, p, steps):  # type: ignore[no-untyped-def]
        return 0.0, 0.0, 0.0, 0.0, 0.0

    @njit(nogil=True, inline="always")
    def none(t, x, v, direction, friction, duration, mass, stiffness, p, k):  # type: ignore[no-untyped-def]
        return 0.0

    every: Callable[..., tuple[float, ...]] = still
    one: Callable[..., float] = none
    offset = 0
    for effect in effects:
        end = offset + len(effect.parameters)
        difference = _difference_quotient(effect.force)
        every = _plus_in_motion(every, difference, offset, end)
        one = _or_in_parameter(one, difference, offset, end)
        offset = end

    @register_jitable
    def in_motion(t, x, v, direction, friction, duration, mass, stiffness, p, steps):  # type: ignore[no-untyped-def]
        return every(t, x, v, direction, friction, duration, mass, stiffness, p, steps)

    @register_jitable
    def in_parameter(t, x, v, direction, friction, duration, mass, stiffness, p, k):  # type: ignore[no-untyped-def]
        return one(t, x, v, direction, friction, duration, mass, stiffness, p, k)

    return Partials(in_motion, in_parameter)


def _difference_quotient(force: Callable[..., float]) -> Callable[..., float]:
    """Of one force, by ``h`` to either side in number ``i`` of what derivatives are taken in.

    It takes the force's own parameters alone.
    """
    force = njit(nogil=True)(getattr(force, "py_func", force))

    @njit(nogil=True)
    def difference(t, x, v, direction, friction, duration, mass, stiffness, own, i, h):  # type: ignore[no-untyped-def]
        dx, dv = h if i == DISPLACEMENT else 0.0, h if i == VELOCITY else 0.0
        dr = h if i == FRICTION else 0.0
        dm, dk = h if i == MASS else 0.0, h if i == STIFFNESS else 0.0
        above, below = own, own
        if i >= OWN:
            above, below = (
                _with_item(own, i - OWN, own[i - OWN] + h),
                _with_item(own, i - OWN, own[i - OWN] - h),
            )
        more = force(
            t, x + dx, v + dv, direction, friction + dr, duration, mass + dm, stiffness + dk, above, 0
        )
        less = force(
            t, x - dx, v - dv, direction, friction - dr, duration, mass - dm, stiffness - dk, below, 0
        )
        return (more - less) / (2.0 * h)

    return difference


def _plus_in_motion(
    first: Callable[..., tuple[float, ...]], difference: Callable[..., float], offset: int, end: int
) -> Callable[..., tuple[float, ...]]:
    """Add the partial derivatives in the state and the constants of the law, by these ``steps``."""

    @njit(nogil=True, inline="always")
    def both(t, x, v, direction, friction, duration, mass, stiffness, p, steps):  # type: ignore[no-untyped-def]
        slopes = first(t, x, v, direction, friction, duration, mass, stiffness, p, steps)
        acts = False
        for k in range(offset, end):
            acts |= p[k] != 0.0
        if acts:
            own = p[offset:end]
            for i in range(len(steps)):
                if steps[i] != 0.0:
                    slope = difference(
                        t, x, v, direction, friction, duration, mass, stiffness, own, i, steps[i]
                    )
                    slopes = _with_item(slopes, i, slopes[i] + slope)
        return slopes

    return both


def _or_in_parameter(
    other: Callable[..., float], difference: Callable[..., float], offset: int, end: int
) -> Callable[..., float]:
    """The partial derivative in parameter ``k``, where it is one of this force."""

    @njit(nogil=True, inline="always")
    def either(t, x, v, direction, friction, duration, mass, stiffness, p, k):  # type: ignore[no-untyped-def]
        if offset <= k < end:
            size = abs(p[k])
            if size == 0.0:
                # one that is zero is moved by as much as the largest; of a force that is off by any amount
                for j in range(offset, end):
                    size = max(size, abs(p[j]))
                if size == 0.0:
                    size = 1.0
            return difference(
                t,
                x,
                v,
                direction,
                friction,
                duration,
                mass,
                stiffness,
                p[offset:end],
                OWN + k - offset,
                PARAMETER_STEP * size,
            )
        return other(t, x, v, direction, friction, duration, mass, stiffness, p, k)

    return either
