"""A fast forward model of the catalogue's laws, for judging on the generator's side what a record can tell.

Fixed-step Runge-Kutta with the velocity zero found inside the step; dimensionless as in
:mod:`experiments.blind.laws`, except that the natural frequency is a parameter near 1.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["PARAMETERS", "STEPS_A_PERIOD", "decay_signal"]

STEPS_A_PERIOD = 40

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
def _level(p: NDArray[np.float64], inverse_vs2: float, t: float, v: float, sign: float, end: float) -> float:
    level = p[1] * (1.0 + p[6] * sign) * (1.0 + p[9] * (t / end - 0.5))
    exponent = v * v * inverse_vs2
    if p[7] != 0.0 and exponent < 40.0:
        level *= 1.0 + p[7] * np.exp(-exponent)
    return level


@njit(cache=True, nogil=True)
def _pull(p: NDArray[np.float64], x: float, v: float) -> float:
    w2 = p[0] * p[0]
    return -w2 * x * (1.0 + p[10] * x * x) - 2.0 * p[4] * p[0] * v - p[5] * v * abs(v)


@njit(cache=True, nogil=True)
def _acc(p: NDArray[np.float64], ivs2: float, t: float, x: float, v: float, sign: float, end: float) -> float:
    return _pull(p, x, v) - sign * p[0] * p[0] * _level(p, ivs2, t, v, sign, end)


@njit(cache=True, nogil=True)
def _step(
    p: NDArray[np.float64], ivs2: float, t: float, x: float, v: float, sign: float, end: float, h: float
) -> tuple[float, float]:
    a1 = _acc(p, ivs2, t, x, v, sign, end)
    v2 = v + 0.5 * h * a1
    a2 = _acc(p, ivs2, t + 0.5 * h, x + 0.5 * h * v, v2, sign, end)
    v3 = v + 0.5 * h * a2
    a3 = _acc(p, ivs2, t + 0.5 * h, x + 0.5 * h * v2, v3, sign, end)
    v4 = v + h * a3
    a4 = _acc(p, ivs2, t + h, x + h * v3, v4, sign, end)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@njit(cache=True, nogil=True)
def _time_to_zero(
    p: NDArray[np.float64],
    ivs2: float,
    t: float,
    x: float,
    v: float,
    sign: float,
    end: float,
    h: float,
    v_end: float,
) -> float:
    """Length of the partial step that ends at zero velocity, by the Illinois form of regula falsi."""
    low, high, f_low, f_high = 0.0, h, v, v_end
    length = h
    for _ in range(60):
        length = (low * f_high - high * f_low) / (f_high - f_low)
        _, f = _step(p, ivs2, t, x, v, sign, end, length)
        if abs(f) < 1e-13 or high - low < 1e-14:
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
        Between steps by cubic Hermite interpolation, error about 1e-6 of the amplitude.
    """
    out = np.empty(times.size)
    t, x, v = 0.0, p[2], p[3]
    ivs2 = np.exp(-2.0 * p[8])
    h0 = 2.0 * np.pi / STEPS_A_PERIOD
    sign = np.sign(v)
    i = 0
    while i < times.size:
        if v == 0.0:
            pull = _pull(p, x, 0.0)
            sign = np.sign(pull)
            if abs(pull) <= p[0] * p[0] * _level(p, ivs2, t, 0.0, sign, end):
                # the records that are judged hold at most a short rest: whoever rests, rests for good
                for j in range(i, times.size):
                    out[j] = x if order == 0 else 0.0
                break
        h = h0
        x1, v1 = _step(p, ivs2, t, x, v, sign, end, h)
        turned = v1 * sign < 0.0
        if (turned and v == 0.0) or abs(x1) > _ESCAPED:
            # held by friction that rises as soon as it moves, or run away on a softening spring
            for j in range(i, times.size):
                out[j] = x if order == 0 else 0.0
            break
        if turned:
            h = _time_to_zero(p, ivs2, t, x, v, sign, end, h, v1)
            x1, v1 = _step(p, ivs2, t, x, v, sign, end, h)
        a0 = _acc(p, ivs2, t, x, v, sign, end)
        a1 = _acc(p, ivs2, t + h, x1, v1, sign, end)
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
                out[i] = _acc(p, ivs2, times[i], position, velocity, sign, end)
            i += 1
        t, x, v = t + h, x1, 0.0 if turned else v1
    return out
