"""The exact free decay under Coulomb friction: Eq. (1) solved half cycle by half cycle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.checks import finite, non_negative
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER, njit
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.motion import Motion, sample_times

__all__ = ["MAX_PHASE", "coulomb_decay", "coulomb_shapes"]

MAX_PHASE = 1e8
"""Longest motion [rad]: rounding has then cost half the digits of the phase."""


def coulomb_decay(
    system: Oscillator,
    friction: float,
    initial_displacement: float,
    initial_velocity: float,
    time: ArrayLike,
) -> Motion:
    r"""Solve ``m x'' + r sign(x') + k x = 0`` exactly, sticking included.

    While the motion goes in direction ``s`` it is a cosine about ``-s d``, ``d = r/k``. Counting half
    cycles ``n`` from the one the motion starts in, with ``theta = w0 (t - t1)`` measured from its end,

    .. math:: x = -s_n d + s\,(A - 2 d n) \cos\theta, \qquad s_n = (-1)^n s,

    so that turning point ``n`` lies at ``s_n (A - d - 2 d n)``. The motion ends at the first one with
    ``|k x| <= r``.

    Parameters
    ----------
    system : Oscillator
        Linear system; not a pendulum.
    friction : float
        Friction force ``r`` [N] or torque [N m], not negative.
    initial_displacement, initial_velocity : float
        State at ``time[0]``.
    time : array_like, shape (n,)
        Ascending sample times [s].

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If the system is a pendulum, or a value is negative, not finite, or overflows.
    """
    if system.pendulum:
        raise InputError("system", "a pendulum has no closed form", "use mechanics.integrate.integrate")
    friction = non_negative("friction", friction)
    x0 = finite("initial_displacement", initial_displacement)
    v0 = finite("initial_velocity", initial_velocity)
    times = sample_times(time)
    w0 = system.natural_frequency
    d = friction / system.stiffness

    if v0 == 0.0 and abs(x0) <= d:
        still = np.zeros_like(times)
        return Motion(
            time=times,
            displacement=np.full_like(times, x0),
            velocity=still,
            acceleration=still.copy(),
            turning_times=times[:1].copy(),
            turning_points=np.array([x0]),
            stop_time=float(times[0]),
        )

    s = math.copysign(1.0, v0 if v0 != 0.0 else -x0)
    amplitude = math.hypot(x0 + s * d, v0 / w0)
    if not math.isfinite(amplitude * max(1.0, w0 * w0)):
        raise InputError(
            "initial state", f"({x0:g}, {v0:g}) overflows", "give a smaller displacement or velocity"
        )
    first_turn = float(times[0]) + math.atan2(abs(v0) / w0, s * x0 + d) / w0
    last = _half_cycles_to_rest(amplitude - d, d)
    theta = w0 * (times - first_turn)
    if not theta[-1] < MAX_PHASE:
        raise InputError("time", f"reaches {times[-1]:g} s, beyond {MAX_PHASE:g} rad of motion", "shorten it")
    n = np.clip(np.floor(theta / math.pi) + 1.0, 0.0, last)
    sense = np.where(n % 2.0 == 0.0, s, -s)
    swing = s * (amplitude - 2.0 * d * n)
    displacement = swing * np.cos(theta) - sense * d
    velocity = -w0 * swing * np.sin(theta)
    acceleration = -w0 * w0 * swing * np.cos(theta)

    stop_time = first_turn + last * math.pi / w0
    reached = min(last, math.floor((float(times[-1]) - first_turn) * w0 / math.pi))
    index = np.arange(0.0, reached + 1.0)
    turning_times = first_turn + index * math.pi / w0
    turning_points = np.where(index % 2.0 == 0.0, s, -s) * (amplitude - d - 2.0 * d * index)
    if v0 == 0.0:
        turning_times = np.concatenate([times[:1], turning_times])
        turning_points = np.concatenate([[x0], turning_points])
    if stop_time <= times[-1]:
        rest = times >= stop_time
        displacement[rest] = turning_points[-1]
        velocity[rest] = 0.0
        acceleration[rest] = 0.0
    else:
        stop_time = math.inf
    return Motion(
        time=times,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        turning_times=turning_times,
        turning_points=turning_points,
        stop_time=stop_time,
    )


def _half_cycles_to_rest(first_amplitude: float, d: float) -> float:
    """Return the first ``n`` with ``first_amplitude - 2 d n <= d``; infinite without friction.

    A turning point on the edge of the sticking band to within rounding counts as inside it.
    """
    excess = first_amplitude - d
    if excess <= 0.0:
        return 0.0
    ratio = excess / (2.0 * d) if d > 0.0 else math.inf
    if ratio > 1e15:
        return math.inf
    return float(math.ceil(ratio * (1.0 - 8.0 * np.finfo(float).eps)))


@njit(**INNER)
def coulomb_shapes(theta: float, order: int) -> tuple[float, float, float, int]:
    """Return how amplitude and friction show in one sample of a Coulomb decay.

    With ``n = floor(theta/pi)`` the signal is ``c + a f + u g``: for displacement ``f = cos(theta)``,
    ``g = (-1)^n - (2n+1) f``; for velocity ``f = -sin(theta)``, for acceleration ``f = -cos(theta)``, both
    with ``g = -(2n+1) f``.

    Returns
    -------
    f, g, slope, n
        ``slope`` is ``df/dtheta``; the signal's own is ``(a - (2n+1) u) slope``.
    """
    n = math.floor(theta / math.pi)
    sine = math.sin(theta)
    cosine = math.cos(theta)
    if order == 0:
        sign = 1.0 if n % 2 == 0 else -1.0
        return cosine, sign - (2 * n + 1) * cosine, -sine, n
    if order == 1:
        return -sine, (2 * n + 1) * sine, -cosine, n
    return -cosine, (2 * n + 1) * cosine, sine, n
