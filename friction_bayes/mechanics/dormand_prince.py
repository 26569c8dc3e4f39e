"""Dormand and Prince's Runge-Kutta method 8(5,3) with its dense output of order 7, compiled.

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10. The tableau is the
one scipy's class carries. The order is high because a free decay is asked for 1e-9 of its amplitude after
a hundred half cycles, for which the fifth-order pair takes about eight times as many steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from friction_bayes.core.kernels import INNER_OF_A_FUNCTION, njit

__all__ = [
    "DENSE",
    "SLOPES",
    "STAGES",
    "Law",
    "acceleration",
    "dense_coefficients",
    "dense_values",
    "error_norm",
    "step",
]

A = np.ascontiguousarray(DOP853.A)
B = np.ascontiguousarray(DOP853.B)
C = np.ascontiguousarray(DOP853.C)
E3 = np.ascontiguousarray(DOP853.E3)
E5 = np.ascontiguousarray(DOP853.E5)
A_EXTRA = np.ascontiguousarray(DOP853.A_EXTRA)
C_EXTRA = np.ascontiguousarray(DOP853.C_EXTRA)
D = np.ascontiguousarray(DOP853.D)

STAGES = 12
SLOPES = STAGES + 1 + C_EXTRA.size
"""Stages, the slope at the end of the step, and those the dense output adds."""
DENSE = 3 + D.shape[0]
"""Coefficients of the dense output."""


class Law(NamedTuple):
    """The constants of the equation of motion."""

    mass: float
    stiffness: float
    pendulum: bool
    friction: float
    duration: float


@njit(**INNER_OF_A_FUNCTION)
def acceleration(force, law, p, t, x, v, direction):  # type: ignore[no-untyped-def]
    """Acceleration while the motion goes in ``direction`` (+1 or -1), [m/s2 or rad/s2]."""
    restoring = law.stiffness * (math.sin(x) if law.pendulum else x)
    extra = force(t, x, v, direction, law.friction, law.duration, law.mass, law.stiffness, p)
    return -(restoring + law.friction * direction + extra) / law.mass


@njit(**INNER_OF_A_FUNCTION)
def step(force, law, p, t, x, v, direction, h, kx, kv):  # type: ignore[no-untyped-def]
    """Advance by ``h``; ``kx, kv`` hold the slopes, of which ``[0]`` must be set, and receive the others.

    Returns
    -------
    x, v : float
        State at ``t + h``; ``kx[12], kv[12]`` are its derivative.
    """
    for i in range(1, STAGES):
        dx = 0.0
        dv = 0.0
        for j in range(i):
            dx += A[i, j] * kx[j]
            dv += A[i, j] * kv[j]
        stage_v = v + h * dv
        kx[i] = stage_v
        kv[i] = acceleration(force, law, p, t + C[i] * h, x + h * dx, stage_v, direction)
    dx = 0.0
    dv = 0.0
    for j in range(STAGES):
        dx += B[j] * kx[j]
        dv += B[j] * kv[j]
    x += h * dx
    v += h * dv
    kx[STAGES] = v
    kv[STAGES] = acceleration(force, law, p, t + h, x, v, direction)
    return x, v


@njit(**INNER_OF_A_FUNCTION)
def error_norm(h, kx, kv, tolerance_x, tolerance_v):  # type: ignore[no-untyped-def]
    """Estimated local error over its tolerance; at most 1 for a step to be accepted."""
    x3 = 0.0
    v3 = 0.0
    x5 = 0.0
    v5 = 0.0
    for j in range(STAGES + 1):
        x3 += E3[j] * kx[j]
        v3 += E3[j] * kv[j]
        x5 += E5[j] * kx[j]
        v5 += E5[j] * kv[j]
    fifth = (x5 / tolerance_x) ** 2 + (v5 / tolerance_v) ** 2
    third = (x3 / tolerance_x) ** 2 + (v3 / tolerance_v) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return abs(h) * fifth / math.sqrt(2.0 * (fifth + 0.01 * third))


@njit(**INNER_OF_A_FUNCTION)
def dense_coefficients(force, law, p, t, x, v, direction, h, new_x, new_v, kx, kv, fx, fv):  # type: ignore[no-untyped-def]
    """Fill ``fx, fv``, shape (DENSE,), with the coefficients of the dense output over the last step."""
    for e in range(C_EXTRA.size):
        dx = 0.0
        dv = 0.0
        for j in range(STAGES + 1 + e):
            dx += A_EXTRA[e, j] * kx[j]
            dv += A_EXTRA[e, j] * kv[j]
        stage_v = v + h * dv
        kx[STAGES + 1 + e] = stage_v
        kv[STAGES + 1 + e] = acceleration(force, law, p, t + C_EXTRA[e] * h, x + h * dx, stage_v, direction)
    _fill(h, x, new_x, kx, fx)
    _fill(h, v, new_v, kv, fv)


@njit(**INNER_OF_A_FUNCTION)
def _fill(h, old, new, k, f):  # type: ignore[no-untyped-def]
    change = new - old
    f[0] = change
    f[1] = h * k[0] - change
    f[2] = 2.0 * change - h * (k[STAGES] + k[0])
    for i in range(D.shape[0]):
        total = 0.0
        for j in range(SLOPES):
            total += D[i, j] * k[j]
        f[3 + i] = h * total


@njit(**INNER_OF_A_FUNCTION)
def dense_values(time, start, h, old, f, out):  # type: ignore[no-untyped-def]
    """Fill ``out`` with the dense output at ``time`` over the step ``h`` from ``old`` at ``start``."""
    # as plain numbers the coefficients cannot alias the output, and the loop vectorises
    f0, f1, f2, f3, f4, f5, f6 = f[0], f[1], f[2], f[3], f[4], f[5], f[6]
    for i in range(time.size):
        s = (time[i] - start) / h
        r = 1.0 - s
        out[i] = old + s * (f0 + r * (f1 + s * (f2 + r * (f3 + s * (f4 + r * (f5 + s * f6))))))
