"""The event-aware loop: half cycles between exact velocity zeros, sticking and break-away."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array
from friction_bayes.core.kernels import INNER_OF_A_FUNCTION, njit
from friction_bayes.mechanics.dormand_prince import (
    DENSE,
    SLOPES,
    STAGES,
    Law,
    acceleration,
    dense_coefficients,
    dense_values,
    error_norm,
    step,
)
from friction_bayes.mechanics.sticking import SampledMotion, departure, rest

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


class State(NamedTuple):
    """The motion at one instant; ``t`` [s] counts as the times of the samples do."""

    t: float
    x: float
    v: float


class Limits(NamedTuple):
    """What the steps of one motion may not exceed.

    Attributes
    ----------
    end : float
        Time of the last sample [s].
    tolerance_x, tolerance_v : float
        Local error of a step.
    step : float
        Its size [s].
    attempts : float
        How many are tried in all.
    speed : float
    """

    end: float
    tolerance_x: float
    tolerance_v: float
    step: float
    attempts: float
    speed: float


class Slopes(NamedTuple):
    """Working arrays of a step: slopes of displacement and velocity, and the polynomials through them."""

    x: Array
    v: Array
    dense_x: Array
    dense_v: Array


@njit(**INNER_OF_A_FUNCTION)
def _to_velocity_zero(force, law, p, t, x, v, direction, h, new_x, kx, kv):  # type: ignore[no-untyped-def]
    """Shorten the step ``h``, at whose end the velocity has reversed, so that it ends at the velocity zero.

    Newton's method on the step itself, kept within the bracket, until the time no longer changes.

    Returns
    -------
    h, new_x : float
        Size of the step, and the displacement at its end.
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


@njit(**INNER_OF_A_FUNCTION)
def _limits(law, x, v, start, end, rtol):  # type: ignore[no-untyped-def]
    """The limits of a motion from ``x, v`` at ``start`` on."""
    w0 = math.sqrt(law.stiffness / law.mass)
    amplitude = math.hypot(x, v / w0) + law.friction / law.stiffness
    if amplitude == 0.0:
        amplitude = 1.0
    tolerance_x = rtol * amplitude
    return Limits(
        end,
        tolerance_x,
        tolerance_x * w0,
        LARGEST_PHASE_STEP / w0,
        STEPS_PER_RADIAN * (w0 * (end - start) + 100.0),
        LARGEST_SPEED * w0 * amplitude,
    )


@njit(**INNER_OF_A_FUNCTION)
def _half_cycle(force, law, p, limits, samples, j, now, direction, h, attempts, slopes):  # type: ignore[no-untyped-def]
    """Move in one direction until the velocity is zero or the samples are over, and fill them.

    One loop: a function that takes the arrays anew in every step costs a tenth of the time.

    Parameters
    ----------
    j : int
        The first sample that is due.
    now : State
    h, attempts : float
        Step to try first, and steps tried so far.

    Returns
    -------
    status : int
        :data:`DIVERGED` when the motion leaves every bound or no step is small enough.
    now : State
        The end; the velocity is exactly zero there unless the samples are over.
    j, h, attempts
        What they are by then.
    """
    time, displacement, velocity, accelerations = samples
    kx, kv, fx, fv = slopes
    t, x, v = now
    kx[0] = v
    kv[0] = acceleration(force, law, p, t, x, v, direction)
    while j < time.size and time[j] <= t:
        displacement[j] = x
        velocity[j] = v
        if accelerations.size > 0:
            accelerations[j] = kv[0]
        j += 1
    turned = False
    while j < time.size and not turned:
        final = h >= limits.end - t
        size = limits.end - t if final else h
        new_x, new_v = step(force, law, p, t, x, v, direction, size, kx, kv)
        error = error_norm(size, kx, kv, limits.tolerance_x, limits.tolerance_v)
        attempts += 1.0
        if not error <= 1.0:
            # a nan fails the comparison above and shortens the step like any large error
            h = size * (max(0.2, 0.9 * error**-0.125) if error < math.inf else 0.2)
            if t + h == t or attempts > limits.attempts:
                return DIVERGED, State(t, x, v), j, h, attempts
            continue
        if attempts > limits.attempts or abs(new_v) > limits.speed:
            return DIVERGED, State(t, x, v), j, h, attempts
        h = min(limits.step, size * min(5.0, 0.9 * error**-0.125 if error > 0.0 else 5.0))
        turned = direction * new_v <= 0.0
        new_t = limits.end if final else t + size
        if turned:
            size, new_x = _to_velocity_zero(force, law, p, t, x, v, direction, size, new_x, kx, kv)
            new_v = kx[STAGES]
            new_t = t + size
        first = j
        # a sample at the velocity zero belongs to what comes after it
        while j < time.size and (time[j] < new_t or (time[j] == new_t and not turned)):
            j += 1
        if j > first:
            dense_coefficients(force, law, p, t, x, v, direction, size, new_x, new_v, kx, kv, fx, fv)
            dense_values(time[first:j], t, size, x, fx, displacement[first:j])
            dense_values(time[first:j], t, size, v, fv, velocity[first:j])
            if accelerations.size > 0:
                for i in range(first, j):
                    accelerations[i] = acceleration(
                        force, law, p, time[i], displacement[i], velocity[i], direction
                    )
        t, x, v = new_t, new_x, 0.0 if turned else new_v
        kx[0] = kx[STAGES]
        kv[0] = kv[STAGES]
    return DONE, State(t, x, v), j, h, attempts


@njit(**INNER_OF_A_FUNCTION)
def _noted(values, count, value):  # type: ignore[no-untyped-def]
    """Put ``value`` at place ``count``, in an array of twice the size where it is full."""
    if count == values.size:
        larger = np.empty(2 * values.size)
        # assigning a slice would compile numba's broadcasting, a third of the compile time of the whole loop
        for i in range(values.size):
            larger[i] = values[i]
        values = larger
    values[count] = value
    return values


@njit(**INNER_OF_A_FUNCTION)
def trajectory(force, time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order):  # type: ignore[no-untyped-def]
    """Integrate one free decay; see :func:`friction_bayes.mechanics.integrate.propagate`."""
    n = time.size
    law = Law(mass, stiffness, pendulum, friction, duration)
    limits = _limits(law, x, v, time[0], time[n - 1], rtol)
    # the forces at the samples cost as much as the motion itself
    accelerations = np.full(n if order == 2 else 0, np.nan)
    samples = SampledMotion(time, np.full(n, np.nan), np.full(n, np.nan), accelerations)
    slopes = Slopes(np.empty(SLOPES), np.empty(SLOPES), np.empty(DENSE), np.empty(DENSE))
    turning_times, turning_points, turns = np.empty(64), np.empty(64), ZERO
    stop_time = math.inf
    now = State(time[0], x, v)
    direction = math.copysign(1.0, v)
    h, attempts = 0.1 * limits.step, 0.0
    status, j = DONE, ZERO
    while j < n and status == DONE:
        if now.v == 0.0:
            turning_times = _noted(turning_times, turns, now.t)
            turning_points = _noted(turning_points, turns, now.x)
            turns += 1
            direction = departure(force, law, p, now.t, now.x)
            if direction == 0.0:
                stop_time = now.t
                t, j, direction = rest(force, law, p, samples, now.t, now.x, j)
                if j == n:
                    break
                stop_time = math.inf
                now = State(t, now.x, 0.0)
        status, now, j, h, attempts = _half_cycle(
            force, law, p, limits, samples, j, now, direction, h, attempts, slopes
        )
    return (
        status,
        samples.displacement,
        samples.velocity,
        samples.acceleration,
        turning_times[:turns].copy(),
        turning_points[:turns].copy(),
        stop_time,
    )
