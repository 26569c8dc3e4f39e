"""Decay under a Coulomb force of changing level, outer force and viscous damping, exact between samples."""

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
    time: Array,
    level: Array,
    external: Array,
    x: float,
    v: float,
    mass: float,
    stiffness: float,
    damping_ratio: float,
) -> tuple[Array, Array, Array, Array, Array, Array, float]:
    """States at the samples, the contact's force there, turning points, and when the final rest begins."""
    n = time.size
    w = math.sqrt(stiffness / mass)
    fading = damping_ratio * w
    damped = w * math.sqrt(1.0 - damping_ratio**2)
    displacement, velocity, acceleration, force = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    turning_times, turning_points = np.zeros(n), np.zeros(n)
    turns = 0
    direction = math.copysign(1.0, v if v != 0.0 else external[0] - stiffness * x)
    stop_time = math.inf
    if v == 0.0 and abs(stiffness * x - external[0]) <= level[0]:
        direction, stop_time = 0.0, time[0]
    for i in range(n):
        r, outside = level[i], external[i]
        displacement[i], velocity[i] = x, v
        # at rest the contact holds whatever pulls
        force[i] = r * direction if direction != 0.0 else outside - stiffness * x
        if direction != 0.0:
            acceleration[i] = (outside - stiffness * x - force[i]) / mass - 2.0 * fading * v
        if i + 1 == n:
            break
        now, end = time[i], time[i + 1]
        while direction != 0.0:
            centre = (outside - direction * r) / stiffness
            y = x - centre
            # displacement and velocity are damped waves of these sine parts about the centre
            of_x, of_v = (v + fading * y) / damped, (fading * v + w**2 * y) / damped
            # what is left of the half turn: all after a reversal, none where rounding overstepped its end
            if direction * v > 0.0:
                angle = math.atan2(direction * v, direction * of_v)
            else:
                angle = math.pi if direction * y < 0.0 else 0.0
            turn = min(angle, damped * (end - now))
            shrunk = math.exp(-fading / damped * turn)
            cosine, sine = math.cos(turn), math.sin(turn)
            x, v = centre + shrunk * (y * cosine + of_x * sine), shrunk * (v * cosine - of_v * sine)
            if now + angle / damped > end:
                break
            now += angle / damped
            v = 0.0
            if turns < n:
                turning_times[turns], turning_points[turns] = now, x
                turns += 1
            if abs(stiffness * x - outside) <= r:
                direction, stop_time = 0.0, now
            else:
                direction = math.copysign(1.0, outside - stiffness * x)
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
    *,
    external_force: ArrayLike | None = None,
    damping_ratio: float = 0.0,
) -> tuple[Motion, Array]:
    r"""Solve ``m x'' + 2 zeta sqrt(k m) x' + r(t) sign(x') + k x = f(t)``.

    Level ``r`` and outer force ``f`` are held from each sample to the next. Between two samples, and between
    a reversal and the next sample, the motion is a damped cosine about ``(f - sign(x') r)/k``; reversals are
    solved for, not stepped over. The motion ends at the first one where spring and outer force together are
    no stronger than the level. It does not break away again: the level is that of the contact along
    its path, and at rest there is no path.

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
    external_force : array_like, shape (n,), optional
        ``f``, from each sample on [N]; none when left out.
    damping_ratio : float
        ``zeta``, at least 0 and less than 1.

    Returns
    -------
    motion : Motion
        The release is not among its turning points.
    force : ndarray, shape (n,)
        ``r(t) sign(x')`` [N]: what a force sensor in the contact would see; what holds the spring at rest.

    Raises
    ------
    InputError
        If the system is a pendulum, shapes differ, a level is negative, a number is not finite, or the
        damping ratio is not in [0, 1).
    """
    if system.pendulum:
        raise InputError("system", "a pendulum has no closed form", "use mechanics.integrate.integrate")
    times, levels = sample_times(time), finite_array("level", level).astype(np.float64)
    if levels.shape != times.shape:
        raise InputError("level", f"has shape {levels.shape}, time {times.shape}", "give one level a sample")
    if levels.min() < 0.0:
        raise InputError("level", f"{levels.min():g} is negative", "give sizes; the motion gives the sign")
    outside = np.zeros(times.size)
    if external_force is not None:
        outside = finite_array("external_force", external_force).astype(np.float64)
    if outside.shape != times.shape:
        raise InputError(
            "external_force", f"has shape {outside.shape}, time {times.shape}", "give one force a sample"
        )
    if not 0.0 <= damping_ratio < 1.0:
        raise InputError("damping_ratio", f"{damping_ratio:g} does not oscillate", "give 0 <= zeta < 1")
    x, v, acceleration, force, turning_times, turning_points, stop_time = _march(
        times,
        levels,
        outside,
        finite("initial_displacement", initial_displacement),
        finite("initial_velocity", initial_velocity),
        system.moving,
        system.stiffness,
        damping_ratio,
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
