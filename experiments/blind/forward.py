"""A fast forward model of the catalogue's laws, for judging on the generator's side what a record can show.

Fixed-step Runge-Kutta with the velocity zero found inside the step; dimensionless as in
:mod:`experiments.blind.laws`, except that the natural frequency is a parameter near 1.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["PARAMETERS", "STEPS_A_PERIOD", "decay_signal"]

STEPS_A_PERIOD = 32

_ESCAPED = 10.0  # initial amplitudes: no decay, so no rival

PARAMETERS = (
    "frequency",
    "friction",
    "displacement",
    "velocity",
    "damping_ratio",
    "drag",
    "asymmetry",
    "static_excess",
    "log_stribeck_velocity",
    "relative_change",
    "cubic",
)
"""Order of the parameter vector."""


@njit(cache=True, nogil=True)
def _constants(p: NDArray[np.float64], end: float) -> NDArray[np.float64]:
    """What the force law needs of the parameters, worked out once."""
    w2 = p[0] * p[0]
    return np.array(
        [w2, w2 * p[10], 2.0 * p[4] * p[0], p[5], p[7], np.exp(-2.0 * p[8]), 1.0 - 0.5 * p[9], p[9] / end]
    )


@njit(cache=True, nogil=True)
def _level(c: NDArray[np.float64], t: float, v: float) -> float:
    """Friction level in units of that of a Coulomb decay."""
    level = c[6] + c[7] * t
    exponent = v * v * c[5]
    if c[4] != 0.0 and exponent < 40.0:
        level *= 1.0 + c[4] * np.exp(-exponent)
    return level


@njit(cache=True, nogil=True)
def _acc(c: NDArray[np.float64], t: float, x: float, v: float, friction: float) -> float:
    """Acceleration; ``friction`` carries the sign of the motion."""
    return -x * (c[0] + c[1] * x * x) - v * (c[2] + c[3] * abs(v)) - friction * _level(c, t, v)


@njit(cache=True, nogil=True)
def _step(
    c: NDArray[np.float64], t: float, x: float, v: float, friction: float, h: float
) -> tuple[float, float]:
    a1 = _acc(c, t, x, v, friction)
    v2 = v + 0.5 * h * a1
    a2 = _acc(c, t + 0.5 * h, x + 0.5 * h * v, v2, friction)
    v3 = v + 0.5 * h * a2
    a3 = _acc(c, t + 0.5 * h, x + 0.5 * h * v2, v3, friction)
    v4 = v + h * a3
    a4 = _acc(c, t + h, x + h * v3, v4, friction)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@njit(cache=True, nogil=True)
def _time_to_zero(
    c: NDArray[np.float64], t: float, x: float, v: float, friction: float, h: float, v_end: float
) -> float:
    """Length of the partial step that ends at zero velocity, by the Illinois form of regula falsi."""
    low, high, f_low, f_high = 0.0, h, v, v_end
    length = h
    for _ in range(60):
        length = (low * f_high - high * f_low) / (f_high - f_low)
        _, f = _step(c, t, x, v, friction, length)
        if abs(f) < 1e-10 or high - low < 1e-12:
            break
        if f * f_high > 0.0:
            high, f_high = length, f
            f_low *= 0.5
        else:
            low, f_low = length, f
            f_high *= 0.5
    return length


@njit(cache=True, nogil=True)
def decay_signal(
    p: NDArray[np.float64], times: NDArray[np.float64], end: float, order: int
) -> NDArray[np.float64]:
    """Displacement (``order`` 0) or acceleration (2) of a free decay.

    Parameters
    ----------
    p : ndarray, shape (11,)
        As in :data:`PARAMETERS`.
    times : ndarray, shape (n,)
        Increasing, from zero on.
    end : float
        Duration ``T`` over which friction drifts.
    order : int
        Derivative order of the signal.

    Returns
    -------
    ndarray, shape (n,)
        Between steps by cubic Hermite interpolation, error about 5e-6 of the amplitude.
    """
    out = np.empty(times.size)
    t, x, v = 0.0, p[2], p[3]
    c = _constants(p, end)
    h0 = 2.0 * np.pi / STEPS_A_PERIOD
    sign = np.sign(v)
    friction = sign * c[0] * p[1] * (1.0 + p[6] * sign)
    i = 0
    while i < times.size:
        if v == 0.0:
            pull = -x * (c[0] + c[1] * x * x)
            sign = np.sign(pull)
            friction = sign * c[0] * p[1] * (1.0 + p[6] * sign)
            if abs(pull) <= abs(friction) * _level(c, t, 0.0):
                # the records that are judged contain at most a short rest: whoever rests, rests for good
                for j in range(i, times.size):
                    out[j] = x if order == 0 else 0.0
                break
        h = h0
        x1, v1 = _step(c, t, x, v, friction, h)
        turned = v1 * sign < 0.0
        if (turned and v == 0.0) or abs(x1) > _ESCAPED:
            # held by friction that rises as soon as it moves, or run away on a softening spring
            for j in range(i, times.size):
                out[j] = x if order == 0 else 0.0
            break
        if turned:
            h = _time_to_zero(c, t, x, v, friction, h, v1)
            x1, v1 = _step(c, t, x, v, friction, h)
        a0 = _acc(c, t, x, v, friction)
        a1 = _acc(c, t + h, x1, v1, friction)
        while i < times.size and times[i] < t + h:
            s = (times[i] - t) / h
            b0 = (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s)
            c0 = s * (1.0 - s) * (1.0 - s) * h
            b1 = s * s * (3.0 - 2.0 * s)
            c1 = -s * s * (1.0 - s) * h
            position = b0 * x + c0 * v + b1 * x1 + c1 * v1
            if order == 0:
                out[i] = position
            else:
                velocity = b0 * v + c0 * a0 + b1 * v1 + c1 * a1
                out[i] = _acc(c, times[i], position, velocity, friction)
            i += 1
        t, x, v = t + h, x1, 0.0 if turned else v1
    return out
