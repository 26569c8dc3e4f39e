"""Free decay under a Coulomb force whose level changes with time, solved exactly from sample to sample."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, finite_array
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.motion import Motion, sample_times

__all__ = ["varying_friction_decay"]


@njit(cache=True, nogil=True)
def _march(
    time: Array, level: Array, x: float, v: float, mass: float, stiffness: float
) -> tuple[Array, Array, Array, Array, Array, Array, float]:
    """States at the samples, the force there, turning points, and when the final rest begins."""
    n = time.size
    w = math.sqrt(stiffness / mass)
    displacement, velocity, acceleration, force = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    turning_times, turning_points = np.zeros(n), np.zeros(n)
    turns = 0
    direction = math.copysign(1.0, v if v != 0.0 else -x)
    stop_time = math.inf
    if v == 0.0 and abs(stiffness * x) <= level[0]:
        direction, stop_time = 0.0, time[0]
    for i in range(n):
        r = level[i]
        displacement[i], velocity[i] = x, v
        # at rest the contact holds whatever the spring pulls
        force[i] = r * direction if direction != 0.0 else -stiffness * x
        acceleration[i] = -(stiffness * x + force[i]) / mass if direction != 0.0 else 0.0
        if i + 1 == n:
            break
        now, end = time[i], time[i + 1]
        while direction != 0.0:
            centre = -direction * r / stiffness
            y, u = x - centre, v / w
            # what is left of the half turn: all after a reversal, none where rounding overstepped its end
            if direction * u > 0.0:
                angle = math.atan2(direction * u, direction * y)
            else:
                angle = math.pi if direction * y < 0.0 else 0.0
            if now + angle / w > end:
                turn = w * (end - now)
                cosine, sine = math.cos(turn), math.sin(turn)
                x, v = centre + y * cosine + u * sine, w * (u * cosine - y * sine)
                break
            now += angle / w
            x, v = centre + direction * math.hypot(y, u), 0.0
            if turns < n:
                turning_times[turns], turning_points[turns] = now, x
                turns += 1
            if abs(stiffness * x) <= r:
                direction, stop_time = 0.0, now
            else:
                direction = -direction
    return (
        displacement,
        velocity,
        acceleration,
        force,
        turning_times[:turns],
        turning_points[:turns],
        stop_time,
    )


def varying_friction_decay(
    system: Oscillator,
    level: ArrayLike,
    initial_displacement: float,
    initial_velocity: float,
    time: ArrayLike,
) -> tuple[Motion, Array]:
    r"""Solve ``m x'' + r(t) sign(x') + k x = 0`` with a level held from each sample to the next.

    Between two samples, and between a reversal and the next sample, the motion is a cosine about
    ``-sign(x') r/k``; reversals are solved for, not stepped over. The motion ends at the first one where the
    spring is no stronger than the level. It does not break away again: the level stands for what the contact
    meets on its path, and at rest there is none.

    Parameters
    ----------
    system : Oscillator
        Linear system; not a pendulum.
    level : array_like, shape (n,)
        Size of the friction force [N] or torque [N m] from each sample on, not negative.
    initial_displacement, initial_velocity : float
        State at ``time[0]``.
    time : array_like, shape (n,)
        Ascending sample times [s].

    Returns
    -------
    motion : Motion
        The release is not among its turning points.
    force : ndarray, shape (n,)
        ``r(t) sign(x')`` [N]: what a force sensor in the contact would see; what holds the spring at rest.

    Raises
    ------
    InputError
        If the system is a pendulum, shapes differ, or a level is negative or not finite.
    """
    if system.pendulum:
        raise InputError("system", "a pendulum has no closed form", "use mechanics.integrate.integrate")
    times, levels = sample_times(time), finite_array("level", level).astype(np.float64)
    if levels.shape != times.shape:
        raise InputError("level", f"has shape {levels.shape}, time {times.shape}", "give one level a sample")
    if levels.min() < 0.0:
        raise InputError("level", f"{levels.min():g} is negative", "give sizes; the motion gives the sign")
    x, v, acceleration, force, turning_times, turning_points, stop_time = _march(
        times,
        levels,
        finite("initial_displacement", initial_displacement),
        finite("initial_velocity", initial_velocity),
        system.moving,
        system.stiffness,
    )
    motion = Motion(
        time=times,
        displacement=x,
        velocity=v,
        acceleration=acceleration,
        turning_times=turning_times,
        turning_points=turning_points,
        stop_time=float(stop_time),
    )
    return motion, force
