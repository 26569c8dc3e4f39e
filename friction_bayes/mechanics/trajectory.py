"""The event-aware loop: half cycles between exact velocity zeros, sticking and break-away."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from friction_bayes.mechanics.dormand_prince import (
    SLOPES,
    STAGES,
    Law,
    acceleration,
    dense_coefficients,
    dense_values,
    error_norm,
    step,
)

__all__ = ["DIVERGED", "DONE", "trajectory"]

DONE = 0
DIVERGED = 1
"""The motion left every bound, or its step size vanished: the outputs from there on are nan."""

LARGEST_PHASE_STEP = 0.7
"""Largest step [rad of the natural frequency]; no velocity zero can then hide within one."""

STEPS_PER_RADIAN = 1000.0
"""Beyond this many the forces are not those of a free decay."""

LARGEST_SPEED = 100.0
"""Over the speed of a linear oscillation of the initial amplitude: beyond it the spring gives way and the
motion escapes, in ever smaller steps."""


@njit(nogil=True)
def _departure(force, law, p, t, x):  # type: ignore[no-untyped-def]
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


@njit(nogil=True)
def _break_away(force, law, p, still, moved, x):  # type: ignore[no-untyped-def]
    """Time between ``still`` and ``moved`` at which a sticking system sets off, by bisection to rounding."""
    while True:
        middle = 0.5 * (still + moved)
        if not still < middle < moved:
            return moved
        if _departure(force, law, p, middle, x) != 0.0:
            moved = middle
        else:
            still = middle


@njit(nogil=True)
def _rest(force, law, p, time, t, x, j):  # type: ignore[no-untyped-def]
    """Stick at ``x`` from sample ``j`` on.

    Returns
    -------
    t : float
        When it breaks away.
    j : int
        The first sample after that, or the number of samples.
    direction : float
        In which it sets off.
    """
    while j < time.size:
        due = time[j] - time[0]
        if due > t:
            direction = _departure(force, law, p, due, x)
            if direction != 0.0:
                return _break_away(force, law, p, t, due, x), j, direction
            t = due
        j += 1
    return t, j, 0.0


@njit(nogil=True)
def _to_velocity_zero(force, law, p, t, x, v, direction, h, new_x, kx, kv):  # type: ignore[no-untyped-def]
    """Shorten the step ``h``, at whose end the velocity has reversed, so that it ends at the velocity zero.

    Newton's method on the step itself, kept within the bracket, until the time no longer changes.
    """
    low = 0.0
    high = h
    new_v = kx[STAGES]
    while True:
        trial = h - new_v / kv[STAGES] if kv[STAGES] != 0.0 else low
        if abs(trial - h) <= 2e-16 * (t + h):
            return h, new_x
        if not low < trial < high:
            trial = 0.5 * (low + high)
            if not low < trial < high:
                return h, new_x
        h = trial
        new_x, new_v = step(force, law, p, t, x, v, direction, h, kx, kv)
        if direction * new_v > 0.0:
            low = h
        else:
            high = h


@njit(nogil=True)
def _grown(values):  # type: ignore[no-untyped-def]
    larger = np.empty(2 * values.size)
    # assigning a slice would compile numba's broadcasting, a third of the compile time of the whole loop
    for i in range(values.size):
        larger[i] = values[i]
    return larger


@njit(nogil=True)
def trajectory(force, time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol):  # type: ignore[no-untyped-def]
    """Integrate one free decay; see :func:`friction_bayes.mechanics.integrate.propagate`."""
    n = time.size
    origin = time[0]
    end = time[n - 1] - origin
    displacement = np.full(n, np.nan)
    velocity = np.full(n, np.nan)
    accelerations = np.full(n, np.nan)
    turning_times = np.empty(64)
    turning_points = np.empty(64)
    turns = 0
    stop_time = math.inf
    law = Law(mass, stiffness, pendulum, friction, duration)
    w0 = math.sqrt(stiffness / mass)
    amplitude = math.hypot(x, v / w0) + friction / stiffness
    if amplitude == 0.0:
        amplitude = 1.0
    tolerance_x = rtol * amplitude
    tolerance_v = tolerance_x * w0
    largest = LARGEST_PHASE_STEP / w0
    budget = STEPS_PER_RADIAN * (w0 * end + 100.0)
    fastest = LARGEST_SPEED * w0 * amplitude
    kx = np.empty(SLOPES)
    kv = np.empty(SLOPES)
    fx = np.empty(7)
    fv = np.empty(7)

    status = DONE
    t = 0.0
    h = 0.1 * largest
    direction = math.copysign(1.0, v)
    j = 0
    while j < n and status == DONE:
        if v == 0.0:
            if turns == turning_times.size:
                turning_times = _grown(turning_times)
                turning_points = _grown(turning_points)
            turning_times[turns] = origin + t
            turning_points[turns] = x
            turns += 1
            direction = _departure(force, law, p, t, x)
            if direction == 0.0:
                first = j
                stop_time = origin + t
                t, j, direction = _rest(force, law, p, time, t, x, j)
                displacement[first:j] = x
                velocity[first:j] = 0.0
                accelerations[first:j] = 0.0
                if j == n:
                    break
                stop_time = math.inf
        kx[0] = v
        kv[0] = acceleration(force, law, p, t, x, v, direction)
        while j < n and time[j] - origin <= t:
            displacement[j] = x
            velocity[j] = v
            accelerations[j] = kv[0]
            j += 1
        reversed_ = False
        while j < n and not reversed_:
            budget -= 1.0
            final = h >= end - t
            size = end - t if final else h
            new_x, new_v = step(force, law, p, t, x, v, direction, size, kx, kv)
            error = error_norm(size, kx, kv, tolerance_x, tolerance_v)
            if not error <= 1.0:
                # a nan fails the comparison above and shortens the step like any large error
                h = size * (max(0.2, 0.9 * error**-0.125) if error < math.inf else 0.2)
                if t + h == t or budget < 0.0:
                    status = DIVERGED
                    break
                continue
            if budget < 0.0 or abs(new_v) > fastest:
                status = DIVERGED
                break
            h = min(largest, size * min(5.0, 0.9 * error**-0.125 if error > 0.0 else 5.0))
            reversed_ = direction * new_v <= 0.0
            new_t = end if final else t + size
            if reversed_:
                size, new_x = _to_velocity_zero(force, law, p, t, x, v, direction, size, new_x, kx, kv)
                new_v = kx[STAGES]
                new_t = t + size
            first = j
            while j < n and (time[j] - origin < new_t or (time[j] - origin == new_t and not reversed_)):
                j += 1
            if j > first:
                dense_coefficients(force, law, p, t, x, v, direction, size, new_x, new_v, kx, kv, fx, fv)
                dense_values(time[first:j], origin + t, size, x, fx, displacement[first:j])
                dense_values(time[first:j], origin + t, size, v, fv, velocity[first:j])
                for i in range(first, j):
                    accelerations[i] = acceleration(
                        force, law, p, time[i] - origin, displacement[i], velocity[i], direction
                    )
            t = new_t
            x = new_x
            v = 0.0 if reversed_ else new_v
            kx[0] = kx[STAGES]
            kv[0] = kv[STAGES]
    return (
        status,
        displacement,
        velocity,
        accelerations,
        turning_times[:turns].copy(),
        turning_points[:turns].copy(),
        stop_time,
    )
