r"""Whitening of a record and its columns under a fluctuating force, and the smoother that belongs to it.

The record is ``y = X beta + h' s + e``: the state ``s = (x, v, d)`` starts at ``x = v = 0`` (the start is two
columns of ``X``) with ``d`` stationary, ``d`` is an Ornstein-Uhlenbeck force of sd ``q`` and ``e`` is white
with sd ``sigma sqrt(R_i)``. Hence

.. math:: y \sim N(X\beta, \sigma^2 V), \quad V = R + (q/\sigma)^2 H C H'

with ``C`` the covariance of the states for unit sd. The gains of the Kalman filter depend on the clock and on
``(q/sigma, tau)`` alone, so one pass turns every column into innovations: with ``L`` the filter and ``S`` the
variances of the innovations, ``inv(V) = L' inv(S) L`` and ``log det V = sum log S_i``. For ``q = 0`` this is
least squares. Units are those of :mod:`friction_bayes.estimators.random_force.transition`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.estimators.random_force.transition import distinct_steps, transition_table

__all__ = ["Clock", "Whitened", "sensor_row", "smooth", "whiten"]


def sensor_row(order: int, zeta: float = 0.0) -> Array:
    """Row ``h``, shape (3,), with which a sensor reads displacement, velocity and random force.

    Parameters
    ----------
    order : int
        Order of the derivative measured: 0 displacement or angle, 1 velocity, 2 acceleration, which is
        ``-x - 2 zeta v + d``.
    zeta : float
        Damping ratio of the reference oscillator.
    """
    return np.array(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, -2.0 * zeta, 1.0))[order])


@dataclass(frozen=True, eq=False)
class Clock:
    """Time stamps and sample variances, prepared once for many passes.

    Attributes
    ----------
    phase : ndarray, shape (n,)
        ``w0 t``.
    steps : ndarray, shape (m,)
        Distinct steps.
    index : ndarray of int, shape (n - 1,)
        Which of them each interval takes.
    variance : ndarray, shape (n,)
        Noise variances relative to each other; infinite for samples that are not to be used.
    zeta : float
        Damping ratio of the reference oscillator.
    """

    phase: Array
    steps: Array
    index: Indices
    variance: Array
    zeta: float = 0.0

    @classmethod
    def of(cls, phase: Array, variance: Array | None = None, zeta: float = 0.0) -> Clock:
        """Prepare ``phase``, shape (n,), with relative variances, shape (n,), one where not given.

        Raises
        ------
        InputError
            If the time stamps do not ascend or a variance is not positive.
        """
        phase = np.ascontiguousarray(phase, dtype=np.float64)
        variance = np.ones(phase.size) if variance is None else np.array(variance, dtype=np.float64)
        if variance.shape != phase.shape or not np.all(variance > 0.0):
            raise InputError(
                "variance",
                f"shape {variance.shape}, least {np.min(variance, initial=np.inf):g}",
                "give a positive number for every sample",
            )
        return cls(phase, *distinct_steps(phase), variance, zeta)


@dataclass(frozen=True, eq=False)
class Whitened:
    """Sums of a whitened block of columns ``B``, of which the last is usually the record.

    Attributes
    ----------
    gram : ndarray, shape (p, p)
        ``B' inv(V) B``.
    log_determinant : float
        ``log det V`` over the samples used.
    used : int
        How many samples were.
    columns : ndarray or None, shape (n, p)
        Whitened columns, zero in samples that were not used; None unless asked for.
    variances : ndarray or None, shape (n,)
        Of the innovations, in units of ``sigma**2``, nan in samples that were not used; None likewise.
    """

    gram: Array
    log_determinant: float
    used: int
    columns: Array | None = None
    variances: Array | None = None


def whiten(
    columns: Array, clock: Clock, row: Array, ratio: float, tau: float, *, keep: bool = False
) -> Whitened:
    """Whiten a block of columns.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Sensor output of every column, the record among them.
    clock : Clock
        Time stamps and variances.
    row : ndarray, shape (3,)
        From :func:`sensor_row`.
    ratio : float
        ``q / sigma``, both in natural units.
    tau : float
        Correlation time of the force as a phase, ``w0 tau``.
    keep : bool
        Whether the whitened columns are wanted too.
    """
    columns = np.ascontiguousarray(columns, dtype=np.float64)
    transitions, covariances = transition_table(clock.steps, clock.zeta, tau)
    gram = np.zeros((columns.shape[1], columns.shape[1]))
    kept = np.zeros(columns.shape if keep else (0, columns.shape[1]))
    variances = np.full(len(kept), np.nan)
    log_determinant, used = _whiten(
        columns,
        clock.index,
        transitions,
        covariances,
        ratio * ratio,
        row,
        clock.variance,
        gram,
        kept,
        variances,
    )
    gram = gram + np.tril(gram, -1).T
    if not keep:
        return Whitened(gram, log_determinant, used)
    return Whitened(gram, log_determinant, used, kept, variances)


def smooth(columns: Array, clock: Clock, row: Array, ratio: float, tau: float) -> tuple[Array, Array]:
    """Smooth the fluctuating state of every column (modified Bryson-Frazier form).

    The form needs no inverse of a covariance, which is singular here at the start and for ``q = 0``.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Usually the one column ``y - X beta``.
    clock, row, ratio, tau
        As in :func:`whiten`.

    Returns
    -------
    states : ndarray, shape (n, 3, p)
        Displacement, velocity and random force of every column.
    covariance : ndarray, shape (n, 3, 3)
        Of the states given ``beta``, in units of ``sigma**2``.
    """
    columns = np.ascontiguousarray(columns, dtype=np.float64)
    transitions, covariances = transition_table(clock.steps, clock.zeta, tau)
    return _smooth(columns, clock.index, transitions, covariances, ratio * ratio, row, clock.variance)


@njit(cache=True, nogil=True)
def _predict_covariance(cov: Array, f: Array, noise: Array, square: float) -> None:
    """``cov = f cov f' + square noise``, written out: calls of BLAS on 3 x 3 take ten times as long."""
    half = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            half[a, b] = f[a, 0] * cov[0, b] + f[a, 1] * cov[1, b] + f[a, 2] * cov[2, b]
    for a in range(3):
        for b in range(a + 1):
            value = half[a, 0] * f[b, 0] + half[a, 1] * f[b, 1] + half[a, 2] * f[b, 2] + square * noise[a, b]
            cov[a, b] = value
            cov[b, a] = value


@njit(cache=True, nogil=True)
def _read(cov: Array, row: Array, variance: float, ph: Array) -> float:
    """Fill ``ph = cov row`` and return the variance of the innovation."""
    for a in range(3):
        ph[a] = cov[a, 0] * row[0] + cov[a, 1] * row[1] + cov[a, 2] * row[2]
    return row[0] * ph[0] + row[1] * ph[1] + row[2] * ph[2] + variance


@njit(cache=True, nogil=True)
def _whiten(
    columns: Array,
    index: Indices,
    transitions: Array,
    covariances: Array,
    square: float,
    row: Array,
    variance: Array,
    gram: Array,
    kept: Array,
    variances: Array,
) -> tuple[float, int]:
    n, p = columns.shape
    x, v, d, e = np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p)
    cov = np.zeros((3, 3))
    cov[2, 2] = square
    ph = np.zeros(3)
    log_determinant = 0.0
    used = 0
    for i in range(n):
        if i > 0:
            f = transitions[index[i - 1]]
            _predict_covariance(cov, f, covariances[index[i - 1]], square)
            f00, f01, f02, f10, f11, f12, f22 = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
            for j in range(p):
                xj, vj, dj = x[j], v[j], d[j]
                x[j] = f00 * xj + f01 * vj + f02 * dj
                v[j] = f10 * xj + f11 * vj + f12 * dj
                d[j] = f22 * dj
        if not np.isfinite(variance[i]):
            continue
        s = _read(cov, row, variance[i], ph)
        log_determinant += math.log(s)
        used += 1
        scale = 1.0 / math.sqrt(s)
        k0, k1, k2 = ph[0] * scale, ph[1] * scale, ph[2] * scale
        for j in range(p):
            ej = (columns[i, j] - row[0] * x[j] - row[1] * v[j] - row[2] * d[j]) * scale
            e[j] = ej
            x[j] += k0 * ej
            v[j] += k1 * ej
            d[j] += k2 * ej
        for a in range(3):
            for b in range(3):
                cov[a, b] -= ph[a] * ph[b] / s
        for j in range(p):
            ej = e[j]
            for k in range(j + 1):
                gram[j, k] += ej * e[k]
        if kept.shape[0] > 0:
            kept[i] = e
            variances[i] = s
    return log_determinant, used


@njit(cache=True, nogil=True)
def _smooth(
    columns: Array,
    index: Indices,
    transitions: Array,
    covariances: Array,
    square: float,
    row: Array,
    variance: Array,
) -> tuple[Array, Array]:
    n, p = columns.shape
    states = np.zeros((n, 3, p))
    predicted = np.zeros((n, 3, 3))
    innovations = np.zeros((n, p))
    inverse = np.zeros(n)
    cov = np.zeros((3, 3))
    cov[2, 2] = square
    ph = np.zeros(3)
    now = np.zeros((3, p))
    for i in range(n):
        if i > 0:
            f = transitions[index[i - 1]]
            _predict_covariance(cov, f, covariances[index[i - 1]], square)
            now = f @ now
        states[i] = now
        predicted[i] = cov
        if not np.isfinite(variance[i]):
            continue
        s = _read(cov, row, variance[i], ph)
        inverse[i] = 1.0 / s
        for j in range(p):
            e = columns[i, j] - row[0] * now[0, j] - row[1] * now[1, j] - row[2] * now[2, j]
            innovations[i, j] = e
            for a in range(3):
                now[a, j] += ph[a] * e / s
        for a in range(3):
            for b in range(3):
                cov[a, b] -= ph[a] * ph[b] / s
    adjoint = np.zeros((3, p))
    information = np.zeros((3, 3))
    covariance = np.zeros((n, 3, 3))
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            f = transitions[index[i]]
            adjoint = f.T @ adjoint
            information = f.T @ information @ f
        if inverse[i] > 0.0:
            s = _read(predicted[i], row, variance[i], ph)
            keep = np.eye(3)
            for a in range(3):
                for b in range(3):
                    keep[a, b] -= ph[a] * row[b] / s
            adjoint = keep.T @ adjoint
            information = keep.T @ information @ keep
            for a in range(3):
                for j in range(p):
                    adjoint[a, j] += row[a] * innovations[i, j] * inverse[i]
                for b in range(3):
                    information[a, b] += row[a] * row[b] * inverse[i]
        states[i] += predicted[i] @ adjoint
        covariance[i] = predicted[i] - predicted[i] @ information @ predicted[i]
        # a difference: where almost everything is learned, rounding must not leave a negative variance
        for a in range(3):
            covariance[i, a, a] = max(covariance[i, a, a], 0.0)
    return states, covariance
