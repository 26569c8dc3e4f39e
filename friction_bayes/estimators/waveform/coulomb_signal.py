"""The signal of a Coulomb decay, its derivatives, and its misfit near an optimum, for the coefficients of
:mod:`friction_bayes.estimators.waveform.normal_equations`.
"""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.estimators.waveform.normal_equations import (
    ADVANCE,
    AMPLITUDE,
    COEFFICIENTS,
    FRICTION,
    OFFSET,
    PHASE,
    NormalEquations,
    Samples,
    Signal,
    accumulate,
    first_at,
    half_cycle_table,
    place,
)
from friction_bayes.statespace.measured_path import NEAR_TURN

__all__ = [
    "CURVED_PAIRS",
    "crossing_misfit",
    "exact_misfit",
    "fill_signal",
    "near_turns",
    "signal_derivatives",
    "signals",
    "states",
    "turning_samples",
]

CURVED_PAIRS = (
    (AMPLITUDE, ADVANCE),
    (AMPLITUDE, PHASE),
    (FRICTION, ADVANCE),
    (FRICTION, PHASE),
    (ADVANCE, ADVANCE),
    (ADVANCE, PHASE),
    (PHASE, PHASE),
)
"""Pairs of coefficients whose second derivative is not zero."""


@njit(**INNER)
def _value(s: float, order: int, half: int, stop: int, p: Array, kappa: float) -> float:
    """Signal at ``s``, taken to lie in half cycle ``half`` (at rest from ``stop`` on) wherever that is."""
    sign = 1.0 if min(half, stop) % 2 == 0 else -1.0
    if half >= stop:
        return p[OFFSET] + (sign * (p[AMPLITUDE] + (kappa - 2.0 * stop) * p[FRICTION]) if order == 0 else 0.0)
    swing = p[AMPLITUDE] + (kappa - 2.0 * half - 1.0) * p[FRICTION]
    value = p[OFFSET] + swing * math.cos(p[ADVANCE] * s + p[PHASE] + 0.5 * math.pi * order)
    return value + sign * p[FRICTION] if order == 0 else value


@njit(**INNER)
def _half_cycle_end(half: int, stop: int, p: Array, samples: Samples) -> int:
    """First sample after half cycle ``half``; the end of the record once at rest."""
    if half >= stop:
        return samples.size
    return first_at(samples, ((half + 1) * math.pi - p[PHASE]) / p[ADVANCE])


@njit(**KERNEL)
def signals(samples: Samples, order: int, p: Array, kappa: float, stop: int) -> Array:
    """Signals of many coefficients, shape (m, 5), over ``n`` samples, shape (m, n)."""
    out = np.empty((p.shape[0], samples.size))
    for row in range(p.shape[0]):
        fill_signal(samples, order, p[row], kappa, stop, out[row])
    return out


@njit(**INNER)
def fill_signal(samples: Samples, order: int, p: Array, kappa: float, stop: int, out: Array) -> None:
    """Fill ``out``, shape (n,), with the signal of coefficients of shape (5,)."""
    n = samples.size
    even = samples.places.size == 0
    turns = half_cycle_table(samples, p[ADVANCE], p[ADVANCE])
    half = math.floor((p[PHASE] - p[ADVANCE]) / math.pi)
    i = 0
    while i < n:
        end = max(_half_cycle_end(half, stop, p, samples), i)
        if even and half < stop:
            k = kappa - 2.0 * half - 1.0
            swing = p[AMPLITUDE] + k * p[FRICTION]
            angle = p[PHASE] + p[ADVANCE] * place(samples, i) + 0.5 * math.pi * order
            constant = p[OFFSET]
            if order == 0:
                constant += p[FRICTION] if half % 2 == 0 else -p[FRICTION]
            along, across = swing * math.cos(angle), swing * math.sin(angle)
            for j in range(end - i):
                out[i + j] = constant + along * turns.cosine[j] - across * turns.sine[j]
        else:
            for j in range(i, end):
                out[j] = _value(place(samples, j), order, half, stop, p, kappa)
        i = end
        half += 1


def states(samples: Samples, p: Array, kappa: float, stop: int) -> Array:
    """Displacement about the rest position and velocity, shape (n, 2), in the unit of the signal."""
    about_rest = np.where(np.arange(COEFFICIENTS) == OFFSET, 0.0, p)[None]
    return np.column_stack([signals(samples, order, about_rest, kappa, stop)[0] for order in (0, 1)])


@njit(**KERNEL)
def turning_samples(samples: Samples, p: Array, stop: int) -> Integers:
    """First sample of every half cycle of the record, zero first, and of the rest."""
    n = samples.size
    half = math.floor((p[PHASE] - p[ADVANCE]) / math.pi)
    count = 1
    while half < stop and _half_cycle_end(half + count - 1, stop, p, samples) < n:
        count += 1
    first = np.zeros(count, dtype=np.int64)
    for k in range(1, count):
        first[k] = _half_cycle_end(half + k - 1, stop, p, samples)
    return first


@njit(**KERNEL)
def near_turns(samples: Samples, p: Array, stop: int) -> Mask:
    """Which samples lie so near a turning point that they may be of either half cycle, shape (n,)."""
    near = np.zeros(samples.size, dtype=np.bool_)
    for i in range(samples.size):
        angle = p[ADVANCE] * place(samples, i) + p[PHASE]
        turn = round(angle / math.pi)
        near[i] = turn <= stop and abs(angle - turn * math.pi) < NEAR_TURN
    return near


@njit(**KERNEL)
def signal_derivatives(
    samples: Samples, order: int, p: Array, kappa: float, stop: int
) -> tuple[Array, Array]:
    """First and second derivatives of the signal, shapes (n, 5) and (n, 7), half cycles held.

    The second ones are those of :data:`CURVED_PAIRS`.
    """
    n = samples.size
    jacobian = np.zeros((n, COEFFICIENTS))
    curvature = np.zeros((n, len(CURVED_PAIRS)))
    half = math.floor((p[PHASE] - p[ADVANCE]) / math.pi)
    end = _half_cycle_end(half, stop, p, samples)
    for i in range(n):
        while i >= end and end < n:
            half += 1
            end = _half_cycle_end(half, stop, p, samples)
        s = place(samples, i)
        sign = 0.0
        if order == 0:
            sign = 1.0 if min(half, stop) % 2 == 0 else -1.0
        jacobian[i, OFFSET] = 1.0
        if half >= stop:
            jacobian[i, AMPLITUDE] = sign
            jacobian[i, FRICTION] = sign * (kappa - 2.0 * stop)
            continue
        k = kappa - 2.0 * half - 1.0
        swing = p[AMPLITUDE] + k * p[FRICTION]
        angle = p[ADVANCE] * s + p[PHASE] + 0.5 * math.pi * order
        f, g = math.cos(angle), -math.sin(angle)
        jacobian[i, AMPLITUDE] = f
        jacobian[i, FRICTION] = sign + k * f
        jacobian[i, ADVANCE] = swing * g * s
        jacobian[i, PHASE] = swing * g
        curvature[i, 0], curvature[i, 1] = g * s, g
        curvature[i, 2], curvature[i, 3] = k * g * s, k * g
        curvature[i, 4], curvature[i, 5], curvature[i, 6] = -swing * f * s * s, -swing * f * s, -swing * f
    return jacobian, curvature


@njit(**KERNEL)
def exact_misfit(y: Array, samples: Samples, order: int, p: Array, kappa: float, stop: int) -> Array:
    """Sum of squared residuals of many coefficients, shape (m, 5) to (m,)."""
    out = np.empty(p.shape[0])
    signal = Signal(y, samples, order, kappa)
    matrix, gradient = np.zeros((COEFFICIENTS, COEFFICIENTS)), np.zeros(COEFFICIENTS)
    for row in range(p.shape[0]):
        out[row] = accumulate(signal, NormalEquations(p[row], matrix, gradient), p[row], stop)
    return out


@njit(**KERNEL)
def crossing_misfit(
    y: Array, samples: Samples, order: int, centre: Array, p: Array, kappa: float, stop: int
) -> Array:
    """Exact correction of the sum of squared residuals taken with the half cycles of ``centre``.

    Only samples that lie in another half cycle under ``p``, shape (m, 5), differ: a few at each turning.
    """
    n = y.size
    out = np.zeros(p.shape[0])
    first_held = math.floor((centre[PHASE] - centre[ADVANCE]) / math.pi)
    for row in range(p.shape[0]):
        half, held = math.floor((p[row, PHASE] - p[row, ADVANCE]) / math.pi), first_held
        end = _half_cycle_end(half, stop, p[row], samples)
        end_held = _half_cycle_end(held, stop, centre, samples)
        i = 0
        while i < n:
            until = min(end, end_held)
            if half != held or (half >= stop) != (held >= stop):
                for j in range(i, until):
                    s = place(samples, j)
                    new = y[j] - _value(s, order, half, stop, p[row], kappa)
                    old = y[j] - _value(s, order, held, stop, p[row], kappa)
                    out[row] += new * new - old * old
            i = max(until, i)
            if end <= i < n:
                half += 1
                end = _half_cycle_end(half, stop, p[row], samples)
            if end_held <= i < n:
                held += 1
                end_held = _half_cycle_end(held, stop, centre, samples)
    return out
