"""Free decay under any force of the catalogue: velocity zeros and sticking found inside the step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate
from typing import Any

import numpy as np
from numba.extending import register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, in_range, non_negative, positive
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER_OF_A_FUNCTION, KERNEL, njit
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.effects import BUILT_IN, ForceEffect, force_effects, force_vector, parse_effects
from friction_bayes.mechanics.motion import Motion, sample_times
from friction_bayes.mechanics.trajectory import DONE, trajectory

__all__ = ["DEFAULT_RTOL", "force_along", "integrate", "propagate", "propagator"]

DEFAULT_RTOL = 1e-11
"""Local error per step over the initial amplitude; keeps a hundred half cycles within 1e-9."""

_as_tuple: Callable[..., Any] = to_fixed_tuple
"""Takes an array and the number of its values; numba hands in what else its type says it needs."""


def _total_force(effects: Sequence[ForceEffect]) -> Callable[..., float]:
    """Compile the sum of the effects' forces, each reading its own stretch of the parameters, a tuple.

    Written into one function: calls, eight deep, took two thirds of the time of an integration. What has no
    parameter but zeros is left out as it runs: most effects are absent from most motions, and every stage of
    a step waits for the sum. Of an array numba would count the references at each of these branches.
    """
    ends = list(accumulate((len(effect.parameters) for effect in effects), initial=0))
    total = _sum([_guarded(effect.force, *ends[k : k + 2]) for k, effect in enumerate(effects)])

    # what is handed to kernels that are kept on disk must be a plain function
    @register_jitable
    def force(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        return total(t, x, v, direction, friction, duration, mass, stiffness, p)

    return force


def _guarded(force: Callable[..., float], offset: int, end: int) -> Callable[..., float]:
    # an effect's force is compiled by whoever wrote it: written into a sum, it is taken from its source
    written = njit(nogil=True, inline="always")(getattr(force, "py_func", force))
    nothing = (0.0,) * (end - offset)

    @njit(nogil=True, inline="always")
    def guarded(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        if p[offset:end] != nothing:
            return written(t, x, v, direction, friction, duration, mass, stiffness, p, offset)
        return 0.0

    return guarded


def _sum(forces: Sequence[Callable[..., float]]) -> Callable[..., float]:
    """Sum by halves, written into one function by LLVM: numba would copy each force anew on every level."""
    if len(forces) == 1:
        return forces[0]
    first, second = _sum(forces[: len(forces) // 2]), _sum(forces[len(forces) // 2 :])

    @njit(**INNER_OF_A_FUNCTION, forceinline=True)
    def both(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        return first(t, x, v, direction, friction, duration, mass, stiffness, p) + second(
            t, x, v, direction, friction, duration, mass, stiffness, p
        )

    return both


_BUILT_IN = frozenset(effect.name for effect in BUILT_IN)
_BUILT_IN_FORCES = tuple(effect for effect in BUILT_IN if isinstance(effect, ForceEffect))
_BUILT_IN_PARAMETERS = sum(len(effect.parameters) for effect in _BUILT_IN_FORCES)
_built_in_force = _total_force(_BUILT_IN_FORCES)


def _driven(force: Callable[..., float]) -> Callable[..., float]:
    """Compile a force and one over time that drives the motion.

    After the parameters come the spacing of its values [s] and the values, linear in between; it acts with
    the motion, not against it as forces of the catalogue do.
    """

    @register_jitable
    def both(t, x, v, direction, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        parameters, spacing, values = p
        place = t / spacing
        k = min(int(place), values.size - 2)
        low, high = values[k], values[k + 1]
        law = force(t, x, v, direction, friction, duration, mass, stiffness, parameters)
        return law - low - (place - k) * (high - low)

    return both


_driven_built_in_force = _driven(_built_in_force)


@njit(**KERNEL)
def _propagate_driven(time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order):  # type: ignore[no-untyped-def]
    p = _as_tuple(p[0], _BUILT_IN_PARAMETERS), p[1], p[2]
    return trajectory(
        _driven_built_in_force, time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order
    )


@njit(**INNER_OF_A_FUNCTION)
def _along(force, phase, x, v, direction, w0, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
    out = np.empty(phase.size)
    unit = mass * w0**2
    for i in range(phase.size):
        time, rate = phase[i] / w0, v[i] * w0
        out[i] = -force(time, x[i], rate, direction[i], friction, duration, mass, stiffness, p) / unit
    return out


@njit(**KERNEL)
def _built_in_along(phase, x, v, direction, w0, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
    p = _as_tuple(p, _BUILT_IN_PARAMETERS)
    return _along(_built_in_force, phase, x, v, direction, w0, friction, duration, mass, stiffness, p)


@njit(**KERNEL)
def propagate(time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order):  # type: ignore[no-untyped-def]
    """Integrate one free decay under the built-in force effects, without checks, for repeated calls.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Ascending sample times [s], writeable (a read-only array compiles anew); ``x, v`` is the state at
        ``time[0]``.
    x, v : float
        Initial displacement and velocity.
    friction, mass, stiffness : float
        ``mass`` is the inertia of a rotational system.
    pendulum : bool
        Restoring torque ``k sin x`` rather than ``k x``.
    duration : float
        Length of the record [s], for friction drift; the times count from its start.
    p : ndarray
        Parameter vector as from :func:`friction_bayes.mechanics.effects.force_vector`; zeros mean
        Coulomb friction alone.
    rtol : float
        Local error per step over the initial amplitude.
    order : int
        Highest derivative wanted: with 2 the acceleration too.

    Returns
    -------
    status : int
        0, or 1 when the motion did not stay finite (samples from there on are nan).
    displacement, velocity, acceleration : ndarray, shape (n,)
        The acceleration is empty where it is not wanted.
    turning_times, turning_points : ndarray
    stop_time : float
        Infinite when it still moves at the end.
    """
    p = _as_tuple(p, _BUILT_IN_PARAMETERS)
    return trajectory(
        _built_in_force, time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order
    )


@lru_cache(maxsize=16)
def _compiled(effects: tuple[ForceEffect, ...]) -> Callable[..., Any]:
    force, parameters = _total_force(effects), sum(len(effect.parameters) for effect in effects)

    @njit(nogil=True)
    def propagate_all(time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order):  # type: ignore[no-untyped-def]
        p = _as_tuple(p, parameters)
        return trajectory(force, time, x, v, friction, mass, stiffness, pendulum, duration, p, rtol, order)

    return propagate_all


def propagator(names: Sequence[str] = ()) -> Callable[..., Any]:
    """Return :func:`propagate`, or its like compiled with the effects registered from outside.

    Parameters
    ----------
    names : sequence of str
        Effects that will be used. Only where one of them was registered from outside is anything compiled:
        once a process, in a few seconds.
    """
    return propagate if _all_built_in(names) else _compiled(force_effects())


def force_along(names: Sequence[str] = ()) -> Callable[..., Any]:
    """Return the function that evaluates the forces of effects along a motion.

    It takes times ``w0 t`` from the start of the record, displacements, velocities ``v / w0`` and directions
    of shape (n,), the frequency ``w0``, then friction, duration, mass, stiffness and the parameter vector as
    :func:`propagate` does, and returns the sum of the effects' forces on the side of the motion's own
    acceleration, shape (n,), over ``mass w0**2``; Coulomb friction itself is not part of it.

    Parameters
    ----------
    names : sequence of str
        Effects that will be used; one registered from outside is compiled once a process.
    """
    return _built_in_along if _all_built_in(names) else _compiled_along(force_effects())


def _all_built_in(names: Sequence[str]) -> bool:
    return _BUILT_IN.issuperset(names) or not any(
        effect.name in names and effect.name not in _BUILT_IN for effect in force_effects()
    )


@lru_cache(maxsize=16)
def _compiled_along(effects: tuple[ForceEffect, ...]) -> Callable[..., Any]:
    force, parameters = _total_force(effects), sum(len(effect.parameters) for effect in effects)

    @njit(nogil=True)
    def along(phase, x, v, direction, w0, friction, duration, mass, stiffness, p):  # type: ignore[no-untyped-def]
        p = _as_tuple(p, parameters)
        return _along(force, phase, x, v, direction, w0, friction, duration, mass, stiffness, p)

    return along


def integrate(
    system: Oscillator,
    friction: float,
    initial_displacement: float,
    initial_velocity: float,
    time: ArrayLike,
    effects: Mapping[str, float] | None = None,
    *,
    duration: float | None = None,
    driving: tuple[float, Array] | None = None,
    rtol: float = DEFAULT_RTOL,
) -> Motion:
    """Integrate the free decay half cycle by half cycle.

    Within a half cycle the direction is fixed and every force smooth; the step in which the velocity
    reverses is shortened until it ends at the velocity zero. There the system goes on in a direction only if
    the acceleration under the friction of that direction points there; otherwise it sticks. While it sticks,
    break-away (friction that falls with time) is looked for from sample to sample and then located to
    rounding.

    Parameters
    ----------
    system : Oscillator
        A pendulum too.
    friction : float
        Friction force [N] or torque [N m], not negative.
    initial_displacement, initial_velocity : float
        State at ``time[0]``.
    time : array_like, shape (n,)
        Ascending sample times [s].
    effects : mapping, optional
        ``{"NAME.PARAMETER": value}`` of force effects.
    duration : float, optional
        Length of the record [s], to which friction drift refers; by default that of ``time``.
    driving : tuple of float and ndarray, optional
        One more force, over time: the spacing [s] and two or more values [N or N m], the first at
        ``time[0]``, linear in between. Of effects from outside the catalogue none may act with it.
    rtol : float
        Local error per step over the initial amplitude.

    Returns
    -------
    Motion

    Raises
    ------
    InputError
        If a value is out of its range, an effect is not a force, or the motion does not stay finite.
    """
    friction = non_negative("friction", friction)
    x0 = finite("initial_displacement", initial_displacement)
    v0 = finite("initial_velocity", initial_velocity)
    rtol = in_range("rtol", rtol, 1e-14, 1e-2)
    times = sample_times(time)
    span = float(times[-1] - times[0])
    # a single sample has no length, and no drift either
    duration = (span or 1.0) if duration is None else positive("duration", duration)
    values = parse_effects(effects)
    forces = [effect.name for effect in force_effects()]
    for name in values:
        if name not in forces:
            raise InputError(
                f"effect {name}", "is not a force", f"give force effects alone: {', '.join(forces)}"
            )
    propagate_forces = propagator(tuple(values))
    parameters: Any = force_vector(values)
    if driving is not None:
        if not _all_built_in(tuple(values)):
            raise InputError("driving", "acts together with effects from outside", "leave one of them out")
        propagate_forces = _propagate_driven
        parameters = (parameters, *driving)
    start = times[0]
    status, x, v, acceleration, turning_times, turning_points, stop_time = propagate_forces(
        times - start,
        x0,
        v0,
        friction,
        float(system.moving),
        float(system.stiffness),
        system.pendulum,
        duration,
        parameters,
        rtol,
        2,
    )
    if status != DONE or not _all_finite(x, v, acceleration):
        raise InputError(
            "motion",
            f"does not stay finite from ({x0:g}, {v0:g}) under these forces",
            "check the signs and sizes of the effects and the initial state",
        )
    return Motion(
        time=times,
        displacement=x,
        velocity=v,
        acceleration=acceleration,
        turning_times=start + turning_times,
        turning_points=turning_points,
        stop_time=float(start + stop_time),
    )


def _all_finite(*arrays: Array) -> bool:
    return all(bool(np.all(np.isfinite(array))) for array in arrays)
