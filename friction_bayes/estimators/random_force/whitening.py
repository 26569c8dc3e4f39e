r"""Whitening of a record and its columns under a fluctuating force, and the smoother that belongs to it.

The record is ``y = X beta + h' s + u + e``: the state ``s = (x, v, d)`` starts at ``x = v = 0`` (the start is
two columns of ``X``) with ``d`` stationary, ``d`` is an Ornstein-Uhlenbeck force of sd ``q``, ``u`` such a
process of sd ``rho sigma`` in the sensor itself, whose errors in neighbouring samples are alike where it
smooths, and ``e`` is white with sd ``sigma sqrt(R_i)``. Hence

.. math:: y \sim N(X\beta, \sigma^2 V), \quad V = R + (q/\sigma)^2 H C H' + \rho^2 U

with ``C`` the covariance of the states for unit sd and ``U`` the correlation of the sensor's errors. The
gains of the Kalman filter depend on the clock, which holds what is said of the sensor, and on
``(q/sigma, tau)`` alone, so one pass turns every column into innovations: with ``L`` the filter and ``S`` the
variances of the innovations, ``inv(V) = L' inv(S) L`` and ``log det V = sum log S_i``. For ``q = rho = 0``
this is least squares. Units are those of :mod:`friction_bayes.estimators.random_force.transition`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.estimators.random_force.transition import distinct_steps, transition_table

__all__ = ["Clock", "CorrelatedError", "Whitened", "sensor_row", "smooth", "whiten"]


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


@dataclass(frozen=True)
class CorrelatedError:
    """An error of the sensor that neighbouring samples share, beside its white noise.

    Attributes
    ----------
    ratio : float
        Its sd over that of the white noise.
    tau : float
        Its correlation time, a phase.
    """

    ratio: float = 0.0
    tau: float = 1.0


@dataclass(frozen=True, eq=False)
class Clock:
    """Time stamps and the sensor's noise, prepared once for many passes.

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
    error : CorrelatedError
        Of the sensor.
    """

    phase: Array
    steps: Array
    index: Indices
    variance: Array
    zeta: float = 0.0
    error: CorrelatedError = CorrelatedError()

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

    def error_table(self) -> tuple[Array, Array]:
        """Decay of the sensor's error over each distinct step and the variance added, both of shape (m,)."""
        decay = np.exp(-self.steps / self.error.tau)
        return decay, self.error.ratio**2 * (1.0 - decay * decay)


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
        *clock.error_table(),
        clock.error.ratio**2,
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
    states : ndarray, shape (n, 4, p)
        Displacement, velocity, random force and correlated error of every column.
    covariance : ndarray, shape (n, 4, 4)
        Of the states given ``beta``, in units of ``sigma**2``.
    """
    columns = np.ascontiguousarray(columns, dtype=np.float64)
    transitions, covariances = transition_table(clock.steps, clock.zeta, tau)
    return _smooth(
        columns,
        clock.index,
        transitions,
        covariances,
        ratio * ratio,
        row,
        clock.variance,
        *clock.error_table(),
        clock.error.ratio**2,
    )


@njit(cache=True, nogil=True)
def _predict_covariance(
    cov: Array, f: Array, noise: Array, square: float, decay: float, added: float
) -> None:
    """One step, written out: calls of BLAS on so small matrices take ten times as long.

    The error of the sensor is the last state and no other drives it.
    """
    half = np.empty((3, 3))
    shared = np.empty(3)
    for a in range(3):
        for b in range(3):
            half[a, b] = f[a, 0] * cov[0, b] + f[a, 1] * cov[1, b] + f[a, 2] * cov[2, b]
        shared[a] = (f[a, 0] * cov[0, 3] + f[a, 1] * cov[1, 3] + f[a, 2] * cov[2, 3]) * decay
    for a in range(3):
        for b in range(a + 1):
            value = half[a, 0] * f[b, 0] + half[a, 1] * f[b, 1] + half[a, 2] * f[b, 2] + square * noise[a, b]
            cov[a, b] = value
            cov[b, a] = value
        cov[a, 3] = shared[a]
        cov[3, a] = shared[a]
    cov[3, 3] = decay * decay * cov[3, 3] + added


@njit(cache=True, nogil=True)
def _read(cov: Array, row: Array, variance: float, ph: Array) -> float:
    """Fill ``ph = cov (row, 1)`` and return the variance of the innovation."""
    for a in range(4):
        ph[a] = cov[a, 0] * row[0] + cov[a, 1] * row[1] + cov[a, 2] * row[2] + cov[a, 3]
    return row[0] * ph[0] + row[1] * ph[1] + row[2] * ph[2] + ph[3] + variance


@njit(cache=True, nogil=True)
def _product(left: Array, right: Array, out: Array) -> Array:
    """Fill ``out = left' right``, which is none of the two, and return it; ``left`` is often symmetric."""
    for a in range(left.shape[1]):
        for b in range(right.shape[1]):
            total = 0.0
            for c in range(left.shape[0]):
                total += left[c, a] * right[c, b]
            out[a, b] = total
    return out


@njit(cache=True, nogil=True)
def _whiten(
    columns: Array,
    index: Indices,
    transitions: Array,
    covariances: Array,
    square: float,
    row: Array,
    variance: Array,
    decays: Array,
    added: Array,
    error: float,
    gram: Array,
    kept: Array,
    variances: Array,
) -> tuple[float, int]:
    n, p = columns.shape
    x, v, d, u, e = np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p)
    cov = np.zeros((4, 4))
    cov[2, 2] = square
    cov[3, 3] = error
    ph = np.zeros(4)
    log_determinant = 0.0
    used = 0
    for i in range(n):
        if i > 0:
            k = index[i - 1]
            f, decay = transitions[k], decays[k]
            _predict_covariance(cov, f, covariances[k], square, decay, added[k])
            f00, f01, f02, f10, f11, f12, f22 = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
            for j in range(p):
                xj, vj, dj = x[j], v[j], d[j]
                x[j] = f00 * xj + f01 * vj + f02 * dj
                v[j] = f10 * xj + f11 * vj + f12 * dj
                d[j] = f22 * dj
                u[j] *= decay
        if not math.isfinite(variance[i]):
            continue
        s = _read(cov, row, variance[i], ph)
        log_determinant += math.log(s)
        used += 1
        scale = 1.0 / math.sqrt(s)
        k0, k1, k2, k3 = ph[0] * scale, ph[1] * scale, ph[2] * scale, ph[3] * scale
        for j in range(p):
            ej = (columns[i, j] - row[0] * x[j] - row[1] * v[j] - row[2] * d[j] - u[j]) * scale
            e[j] = ej
            x[j] += k0 * ej
            v[j] += k1 * ej
            d[j] += k2 * ej
            u[j] += k3 * ej
        for a in range(4):
            for b in range(4):
                cov[a, b] -= ph[a] * ph[b] / s
        for j in range(p):
            ej = e[j]
            for k in range(j + 1):
                gram[j, k] += ej * e[k]
        if kept.shape[0] > 0:
            for j in range(p):
                kept[i, j] = e[j]
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
    decays: Array,
    added: Array,
    error: float,
) -> tuple[Array, Array]:
    n, p = columns.shape
    states = np.zeros((n, 4, p))
    predicted = np.zeros((n, 4, 4))
    innovations = np.zeros((n, p))
    inverse = np.zeros(n)
    cov = np.zeros((4, 4))
    cov[2, 2] = square
    cov[3, 3] = error
    ph = np.zeros(4)
    now = np.zeros((4, p))
    for i in range(n):
        if i > 0:
            k = index[i - 1]
            f = transitions[k]
            _predict_covariance(cov, f, covariances[k], square, decays[k], added[k])
            for j in range(p):
                x, v, d = now[0, j], now[1, j], now[2, j]
                now[0, j] = f[0, 0] * x + f[0, 1] * v + f[0, 2] * d
                now[1, j] = f[1, 0] * x + f[1, 1] * v + f[1, 2] * d
                now[2, j] = f[2, 2] * d
                now[3, j] *= decays[k]
        for a in range(4):
            for j in range(p):
                states[i, a, j] = now[a, j]
            for b in range(4):
                predicted[i, a, b] = cov[a, b]
        if not math.isfinite(variance[i]):
            continue
        s = _read(cov, row, variance[i], ph)
        inverse[i] = 1.0 / s
        for j in range(p):
            e = columns[i, j] - row[0] * now[0, j] - row[1] * now[1, j] - row[2] * now[2, j] - now[3, j]
            innovations[i, j] = e
            for a in range(4):
                now[a, j] += ph[a] * e / s
        for a in range(4):
            for b in range(4):
                cov[a, b] -= ph[a] * ph[b] / s
    f = np.zeros((4, 4))
    shown = np.ones(4)
    for a in range(3):
        shown[a] = row[a]
    adjoint, shift = np.zeros((4, p)), np.zeros((4, p))
    information, keep, half = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    covariance = np.zeros((n, 4, 4))
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            for a in range(3):
                for b in range(3):
                    f[a, b] = transitions[index[i], a, b]
            f[3, 3] = decays[index[i]]
            adjoint, shift = _product(f, adjoint, shift), adjoint
            information = _product(_product(information, f, half), f, information)
        if inverse[i] > 0.0:
            s = _read(predicted[i], row, variance[i], ph)
            for a in range(4):
                for b in range(4):
                    keep[a, b] = (1.0 if a == b else 0.0) - ph[a] * shown[b] / s
            adjoint, shift = _product(keep, adjoint, shift), adjoint
            information = _product(_product(information, keep, half), keep, information)
            for a in range(4):
                for j in range(p):
                    adjoint[a, j] += shown[a] * innovations[i, j] * inverse[i]
                for b in range(4):
                    information[a, b] += shown[a] * shown[b] * inverse[i]
        _product(predicted[i], adjoint, shift)
        _product(predicted[i], _product(information, predicted[i], half), covariance[i])
        for a in range(4):
            for j in range(p):
                states[i, a, j] += shift[a, j]
            for b in range(4):
                covariance[i, a, b] = predicted[i, a, b] - covariance[i, a, b]
            # a difference: where almost everything is learned, rounding must not leave a negative variance
            covariance[i, a, a] = max(covariance[i, a, a], 0.0)
    return states, covariance
