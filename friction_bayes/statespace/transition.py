r"""Exact discretisation of an oscillator driven by an Ornstein-Uhlenbeck force.

Natural units throughout: time is the phase ``w0 t``, velocity is divided by ``w0`` and force per mass by
``w0**2``, so that displacement, velocity, acceleration and force all carry the unit of displacement and the
friction coefficient is ``r/k``. With the state ``s = (x, v, d)``

.. math:: ds = A s\,dt + e_3 \sqrt{2/\tau}\,q\,dW, \quad
          A = \begin{pmatrix}0&1&0\\-\kappa&0&1\\0&0&-1/\tau\end{pmatrix}

with the stiffness ``kappa`` one, but for a pendulum that swings far (see
:mod:`friction_bayes.statespace.measured_path`), a step ``h`` gives ``s' = F s + w`` with
``F = exp(A h)`` and, for ``q = 1``, ``cov w = (2/tau) int_0^h exp(A u) e3 e3' exp(A' u) du``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER, KERNEL, njit

__all__ = [
    "ForcedSteps",
    "discretise",
    "distinct_steps",
    "free_motion",
    "initial_response",
    "transition_table",
]

_TAYLOR_TERMS = 14
_LARGEST_NORM = 0.125
"""Of ``A h`` at the step where the series are summed: ``0.125**14 / 14!`` is far below rounding."""
_SAME_STEP = 1e-7
"""Steps closer than this share of the median step are one."""


class ForcedSteps(NamedTuple):
    """Oscillator and random force from sample to sample.

    Attributes
    ----------
    step : ndarray of int, shape (n - 1,)
        Which of the distinct steps each interval takes.
    transitions, added : ndarray, shape (m, 3, 3)
        Of each distinct step, and what the force adds to the covariance.
    square : float
        Variance of the force at the start.
    """

    step: Indices
    transitions: Array
    added: Array
    square: float


@njit(**INNER)
def discretise(step: float, stiffness: float, tau: float, transition: Array, covariance: Array) -> None:
    """Fill transition and covariance, both of shape (3, 3), of one step of a force of unit sd.

    Both series are summed at a step so short that they converge at once, and doubled from there:
    ``Q(2h) = Q(h) + F(h) Q(h) F(h)'``, ``F(2h) = F(h)**2``. Nothing is subtracted, so the covariance stays
    positive and keeps its relative accuracy even where it goes with the fifth power of the step.
    """
    doublings = 0
    short = step
    norm = max(1.0 + max(abs(stiffness), 1.0), 1.0 / tau)
    while short * norm > _LARGEST_NORM:
        short *= 0.5
        doublings += 1
    rate = 1.0 / tau
    # rows of exp(A h): (a, b, p), (c, e, r), (0, 0, s); t.. are the terms of its series
    a, b, p, c, e, r, s = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0
    ta, tb, tp, tc, te, tr, ts = a, b, p, c, e, r, s
    for order in range(1, _TAYLOR_TERMS):
        h = short / order
        ta, tb, tp = -stiffness * tb * h, ta * h, (tb - rate * tp) * h
        tc, te, tr = -stiffness * te * h, tc * h, (te - rate * tr) * h
        ts = -rate * ts * h
        a, b, p, c, e, r, s = a + ta, b + tb, p + tp, c + tc, e + te, r + tr, s + ts
    # the six entries of the covariance and, as k.., the terms of their series
    kxx, kxv, kxd, kvv, kvd, kdd = 0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * rate * short
    xx, xv, xd, vv, vd, dd = kxx, kxv, kxd, kvv, kvd, kdd
    for order in range(2, _TAYLOR_TERMS):
        h = short / order
        nxx = 2.0 * kxv
        nxv = kvv - stiffness * kxx + kxd
        nxd = kvd - rate * kxd
        nvv = 2.0 * (kvd - stiffness * kxv)
        nvd = kdd - stiffness * kxd - rate * kvd
        ndd = -2.0 * rate * kdd
        kxx, kxv, kxd, kvv, kvd, kdd = nxx * h, nxv * h, nxd * h, nvv * h, nvd * h, ndd * h
        xx, xv, xd, vv, vd, dd = xx + kxx, xv + kxv, xd + kxd, vv + kvv, vd + kvd, dd + kdd
    for _ in range(doublings):
        ux, uv, ud = a * xx + b * xv + p * xd, a * xv + b * vv + p * vd, a * xd + b * vd + p * dd
        wx, wv, wd = c * xx + e * xv + r * xd, c * xv + e * vv + r * vd, c * xd + e * vd + r * dd
        xx += ux * a + uv * b + ud * p
        xv += ux * c + uv * e + ud * r
        xd += ud * s
        vv += wx * c + wv * e + wd * r
        vd += wd * s
        dd += s * dd * s
        a, b, p, c, e, r = (
            a * a + b * c,
            a * b + b * e,
            a * p + b * r + p * s,
            c * a + e * c,
            c * b + e * e,
            c * p + e * r + r * s,
        )
        s *= s
    transition[0, 0], transition[0, 1], transition[0, 2] = a, b, p
    transition[1, 0], transition[1, 1], transition[1, 2] = c, e, r
    transition[2, 0], transition[2, 1], transition[2, 2] = 0.0, 0.0, s
    covariance[0, 0], covariance[0, 1], covariance[0, 2] = xx, xv, xd
    covariance[1, 0], covariance[1, 1], covariance[1, 2] = xv, vv, vd
    covariance[2, 0], covariance[2, 1], covariance[2, 2] = xd, vd, dd


@njit(**INNER)
def free_motion(h: float, stiffness: float) -> tuple[float, float]:
    """Displacement from a unit displacement, and from a unit velocity, after a phase ``h``."""
    if stiffness > 0.0:
        omega = math.sqrt(stiffness)
        return math.cos(omega * h), math.sin(omega * h) / omega
    if stiffness < 0.0:
        rate = math.sqrt(-stiffness)
        return math.cosh(rate * h), math.sinh(rate * h) / rate
    return 1.0, h


def initial_response(phase: Array, stiffness: Array | None = None) -> Array:
    """Displacement and velocity, shape (n, 2, 2), that follow from a unit of each at the first sample.

    The oscillator has the ``stiffness``, shape (n - 1,), over each interval, or one throughout.
    """
    return _free_states(phase, np.ones(phase.size - 1) if stiffness is None else stiffness)


@njit(**KERNEL)
def _free_states(phase: Array, stiffness: Array) -> Array:
    states = np.zeros((phase.size, 2, 2))
    states[0, 0, 0] = states[0, 1, 1] = 1.0
    for i in range(phase.size - 1):
        cosine, sine = free_motion(phase[i + 1] - phase[i], stiffness[i])
        back = -stiffness[i] * sine
        for j in range(2):
            states[i + 1, 0, j] = cosine * states[i, 0, j] + sine * states[i, 1, j]
            states[i + 1, 1, j] = back * states[i, 0, j] + cosine * states[i, 1, j]
    return states


@njit(**KERNEL)
def transition_table(steps: Array, stiffness: Array, tau: float) -> tuple[Array, Array]:
    """Transitions and covariances for unit sd, both of shape (m, 3, 3), of steps and stiffnesses, (m,)."""
    transitions = np.empty((steps.size, 3, 3))
    covariances = np.empty((steps.size, 3, 3))
    for i in range(steps.size):
        discretise(steps[i], stiffness[i], tau, transitions[i], covariances[i])
    return transitions, covariances


def distinct_steps(
    phase: Array, stiffness: Array | None = None, jump: Array | None = None
) -> tuple[Array, Array, Array, Indices]:
    """Distinct steps of a clock, and which of them each interval takes.

    Parameters
    ----------
    phase : ndarray, shape (n,)
        ``w0 t``, ascending.
    stiffness : ndarray, optional, shape (n - 1,)
        Of the oscillator over each interval; one where left out.
    jump : ndarray, optional, shape (n - 1,)
        How far the force may jump in each interval; none where left out.

    Returns
    -------
    steps : ndarray, shape (m,)
        Mean of the steps that count as one.
    stiffness, jump : ndarray, shape (m,)
        Over each of them.
    index : ndarray of int, shape (n - 1,)
        Which of them each interval takes.

    Raises
    ------
    InputError
        If fewer than two time stamps are given or they do not ascend.
    """
    steps = np.diff(phase)
    if steps.size == 0 or not np.all(steps > 0.0):
        raise InputError("time", "the time stamps do not ascend", "sort the samples and drop doubled ones")
    unit = _SAME_STEP * float(np.median(steps))
    bent, bend = np.unique(np.ones(1) if stiffness is None else stiffness, return_inverse=True)
    jumps, jumping = np.unique(np.zeros(1) if jump is None else jump, return_inverse=True)
    kind = bend * jumps.size + jumping
    kinds, index = np.unique(np.round(steps / unit) * (bent.size * jumps.size) + kind, return_inverse=True)
    bend, jumping = np.divmod(np.mod(kinds, bent.size * jumps.size).astype(np.intp), jumps.size)
    return np.bincount(index, weights=steps) / np.bincount(index), bent[bend], jumps[jumping], index
