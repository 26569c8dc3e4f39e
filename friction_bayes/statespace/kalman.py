r"""Whitening of a record and its columns under a random force, and the smoother that belongs to it.

The record is ``y = X beta + h' s + u + e``: the state ``s = (x, v, d)`` starts at ``x = v = 0`` (the start is
two columns of ``X``) with ``d`` stationary, ``d`` is an Ornstein-Uhlenbeck force of sd ``q``, ``u`` such a
process of sd ``rho sigma`` in the sensor itself, whose errors in neighbouring samples are correlated where
it smooths, and ``e`` is white with sd ``sigma sqrt(R_i)``. Hence

.. math:: y \sim N(X\beta, \sigma^2 V), \quad V = R + (q/\sigma)^2 H C H' + \rho^2 U

with ``C`` the covariance of the states for unit sd and ``U`` the correlation of the sensor's errors. The
gains of the Kalman filter depend on the clock, which contains the description of the sensor, and on
``(q/sigma, tau)`` alone, so one pass turns every column into innovations: with ``L`` the filter and ``S`` the
variances of the innovations, ``inv(V) = L' inv(S) L`` and ``log det V = sum log S_i``. For ``q = rho = 0``
this is least squares. Units are those of :mod:`friction_bayes.statespace.transition`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import ZERO, Array, Indices, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.coloured_noise import (
    Autoregression,
    coloured_gains,
    coloured_innovations,
)
from friction_bayes.statespace.transition import ForcedSteps, distinct_steps, transition_table

__all__ = [
    "Clock",
    "CorrelatedError",
    "Whitened",
    "colour",
    "filter_gains",
    "jump_scores",
    "sensor_row",
    "shown",
    "smooth",
    "whiten",
    "whitened_innovations",
]

_VARIANCES = ((0, 0), (0, 4), (0, 7), (0, 9), (4, 4), (4, 7), (4, 9), (7, 7), (7, 9), (9, 9))
"""Places of the two variances that belong to each entry of a covariance's upper triangle, row by row."""
_ROUNDING = 4e-15
_NO_CHANGE = 1e-9
"""Of a perturbation over an interval, which is rounding."""
_EVEN = 0.5
"""Of the mean step, by which steps may differ: stamps with jitter, but no sample missing."""
_TELLING = 0.02
"""Of the median of the information on a jump, below which a sample is too near the end to show one."""


def sensor_row(order: int, slope: Array | None = None) -> Array:
    """Row ``h`` with which a sensor reads displacement, velocity and random force.

    Parameters
    ----------
    order : int
        Order of the derivative measured: 0 displacement or angle, 1 velocity, 2 acceleration, which is
        ``-kappa x + d``.
    slope : ndarray, optional, shape (n,)
        ``kappa`` at the samples, the slope of the restoring force; one throughout where left out.

    Returns
    -------
    ndarray, shape (3,) or (n, 3)
        One row, or where it changes in time that of each sample.
    """
    row = np.array(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 1.0))[order])
    if order < 2 or slope is None or np.all(slope == 1.0):
        return row
    return np.column_stack([-slope, np.zeros(slope.size), np.ones(slope.size)])


def shown(states: Array, row: Array) -> Array:
    """Sensor reading, shape (n,), of displacements, velocities and random forces, shape (n, 3)."""
    return np.asarray(np.einsum("...j,...j->...", states, row))


@dataclass(frozen=True)
class CorrelatedError:
    """An error of the sensor that neighbouring samples share, in addition to its white noise.

    Attributes
    ----------
    ratio : float
        Its sd over that of the white noise.
    tau : float
        Its correlation time, a phase.
    """

    ratio: float = 0.0
    tau: float = 1.0


class ErrorSteps(NamedTuple):
    """The sensor's error over the distinct steps of a clock.

    Attributes
    ----------
    decays, added : ndarray, shape (m,)
        What each step leaves of it, and the variance that it adds.
    square : float
        Its variance, in units of that of the white noise.
    """

    decays: Array
    added: Array
    square: float


@dataclass(frozen=True, eq=False)
class Clock:
    """Time stamps and the sensor's noise, prepared once for many passes.

    Attributes
    ----------
    phase : ndarray, shape (n,)
        ``w0 t``.
    steps, stiffness : ndarray, shape (m,)
        Distinct steps, and the stiffness of the oscillator over each.
    jump : ndarray, shape (m,)
        Sd, over that of the white noise, by which the force may jump in such a step in addition to its own
        increment.
    index : ndarray of int, shape (n - 1,)
        Which of them each interval takes.
    variance : ndarray, shape (n,)
        Noise variances relative to each other; infinite for samples that are not to be used.
    error : CorrelatedError
        Of the sensor.
    acts : ndarray of int, shape (k,)
        Intervals over which the forces of a law change a perturbation.
    feedback : ndarray, shape (k, 2, 2)
        Its propagation by these, which depend on the motion, relative to the oscillator alone.
    autoregression : Autoregression or None
        Coloured noise in place of the white noise and the correlated error, from sample to sample.
    """

    phase: Array
    steps: Array
    stiffness: Array
    jump: Array
    index: Indices
    variance: Array
    acts: Indices
    feedback: Array
    error: CorrelatedError = CorrelatedError()
    autoregression: Autoregression | None = None

    @classmethod
    def of(
        cls,
        phase: Array,
        variance: Array | None = None,
        stiffness: Array | None = None,
        jump: Array | None = None,
        feedback: Array | None = None,
    ) -> Clock:
        """Prepare ``phase``, shape (n,), with relative variances, shape (n,), one where not given.

        The stiffness over each interval, shape (n - 1,), is one where it is not given, and the jump zero. The
        feedback of a law is that of each interval, shape (n - 1, 2, 2), from
        :func:`friction_bayes.statespace.response.feedback_steps`; the identity where left out.

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
        change = np.empty((0, 2, 2)) if feedback is None else feedback
        acts = np.flatnonzero(np.max(np.abs(change - np.eye(2)), axis=(1, 2)) > _NO_CHANGE)
        return cls(phase, *distinct_steps(phase, stiffness, jump), variance, acts, change[acts])

    @property
    def used(self) -> Mask:
        """Which samples are used, shape (n,)."""
        return np.asarray(np.isfinite(self.variance))

    @property
    def jumps(self) -> Array:
        """How far the force may jump in each interval, over the noise, shape (n - 1,)."""
        return np.asarray(self.jump[self.index])

    @property
    def even(self) -> bool:
        """Whether all steps are equal, as closely as noise from sample to sample requires."""
        return bool(np.ptp(self.steps) < _EVEN * float(np.mean(self.steps)))

    @cached_property
    def error_steps(self) -> ErrorSteps:
        """The sensor's error over the steps of :meth:`forced_steps`."""
        distinct, square = np.exp(-self.steps / self.error.tau), self.error.ratio**2
        decays = np.concatenate([distinct, distinct[self.index[self.acts]]])
        return ErrorSteps(decays, square * (1.0 - decays * decays), square)

    def forced_steps(self, ratio: float, tau: float) -> ForcedSteps:
        """Oscillator and force over the distinct steps, and over each interval in which a law's forces act.

        For a force of sd ``ratio`` times that of the noise, correlated over a phase ``tau``; a jump comes at
        any time within its step, as the force itself does.
        """
        transitions, covariances = transition_table(self.steps, self.stiffness, tau)
        added = ratio * ratio * covariances
        jumping = self.jump > 0.0
        if jumping.any():
            of_jump = self.jump[jumping] ** 2 / covariances[jumping, 2, 2]
            added[jumping] += of_jump[:, None, None] * covariances[jumping]
        if self.acts.size == 0:
            return ForcedSteps(self.index, transitions, added, ratio * ratio)
        index = self.index.copy()
        index[self.acts] = self.steps.size + np.arange(self.acts.size)
        transitions, added = _with_law(self.feedback, self.index[self.acts], transitions, added)
        return ForcedSteps(index, transitions, added, ratio * ratio)


class Whitened(NamedTuple):
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
        Whitened columns, zero in samples that were not used; None unless requested.
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
    """Whitened sums of a block of columns.

    Parameters
    ----------
    columns : ndarray, shape (n, p)
        Sensor output of every column, the record among them.
    clock : Clock
        Time stamps and variances.
    row : ndarray, shape (3,) or (n, 3)
        From :func:`sensor_row`.
    ratio : float
        ``q / sigma``, both in natural units.
    tau : float
        Correlation time of the force as a phase, ``w0 tau``.
    keep : bool
        Whether the whitened columns are wanted too.
    """
    columns, rows = np.ascontiguousarray(columns, dtype=np.float64), row.reshape(-1, 3)
    if clock.autoregression is None:
        steps, transitions, decays, gains = _filter(clock, row, ratio, tau, np.empty((0, 4, 4)))
        white = whitened_innovations(columns, steps, transitions, decays, rows, gains)
    else:
        force, noise = clock.forced_steps(ratio, tau), clock.autoregression
        gains = coloured_gains(force, noise.lagged, rows, clock.variance)
        white = coloured_innovations(columns, force.step, force.transitions, rows, noise.coefficients, gains)
    whitened = Whitened(white.T @ white, *_log_determinant(gains))
    if not keep:
        return whitened
    scale = gains[:, -1]
    used = scale > 0.0
    variances = np.full(used.size, np.nan)
    variances[used] = scale[used] ** -2.0
    return whitened._replace(columns=white, variances=variances)


def colour(white: Array, clock: Clock, row: Array, ratio: float, tau: float) -> Array:
    """Columns, shape (n, p), that :func:`whiten` turns into these: records from independent normal numbers.

    Parameters
    ----------
    white : ndarray, shape (n, p)
        Innovations, each over its standard deviation.
    clock, row, ratio, tau
        As in :func:`whiten`; samples that are not used are what the others predict of them.
    """
    steps, transitions, decays, gains = _filter(clock, row, ratio, tau, np.empty((0, 4, 4)))
    return _coloured(white, steps, transitions, decays, row.reshape(-1, 3), gains)


def smooth(columns: Array, clock: Clock, row: Array, ratio: float, tau: float) -> tuple[Array, Array]:
    """Smoothed random state of every column (modified Bryson-Frazier form).

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
    if clock.autoregression is not None:
        if ratio > 0.0:
            raise ValueError("a random force with coloured noise is whitened, not smoothed")
        # there is no motion in addition to the law
        return np.zeros((len(columns), 4, columns.shape[1])), np.zeros((len(columns), 4, 4))
    return _smoothed(columns, clock, row, ratio, tau)[:2]


def jump_scores(column: Array, clock: Clock, row: Array, ratio: float, tau: float) -> Array:
    """How much a jump of the force before each sample would explain, in standard deviations, shape (n,).

    The derivatives of the log density of a column with respect to the jumps (de Jong and Penzer's auxiliary
    residuals): normal with the sd of the white noise, neighbours correlated, where the column is what the
    filter describes. Zero where the samples after it contain no information about a jump.

    Parameters
    ----------
    column : ndarray, shape (n,)
        Usually ``y - X beta``.
    clock, row, ratio, tau
        As in :func:`whiten`.
    """
    score, information = _smoothed(column[:, None], clock, row, ratio, tau)[2].T
    telling = information > _TELLING * np.median(information)
    return np.asarray(np.where(telling, score / np.sqrt(np.where(telling, information, 1.0)), 0.0))


def _filter(
    clock: Clock, row: Array, ratio: float, tau: float, predicted: Array
) -> tuple[Indices, Array, Array, Array]:
    """Step of each interval, transitions, the error's decays and the gains of :func:`filter_gains`."""
    force, error = clock.forced_steps(ratio, tau), clock.error_steps
    gains = filter_gains(force, error, row.reshape(-1, 3), clock.variance, predicted)
    return force.step, force.transitions, error.decays, gains


def _smoothed(
    columns: Array, clock: Clock, row: Array, ratio: float, tau: float
) -> tuple[Array, Array, Array]:
    """Smoothed states and their covariance as of :func:`smooth`, and of jumps as :func:`_looked_back`."""
    columns, rows = np.ascontiguousarray(columns, dtype=np.float64), row.reshape(-1, 3)
    predicted = np.empty((len(columns), 4, 4))
    index, transitions, decays, gains = _filter(clock, row, ratio, tau, predicted)
    states, innovations = _looked_ahead(columns, index, transitions, decays, rows, gains)
    return _looked_back(states, innovations, index, transitions, decays, rows, gains, predicted)


@njit(**KERNEL)
def _with_law(feedback: Array, step: Indices, transitions: Array, added: Array) -> tuple[Array, Array]:
    """Transitions and covariances of steps, and after them of those that a law takes part in."""
    m = len(transitions)
    all_transitions = np.empty((m + step.size, 3, 3))
    all_added = np.empty((m + step.size, 3, 3))
    # by loops: slice assignment costs the compiler seconds
    for i in range(m):
        for a in range(3):
            for b in range(3):
                all_transitions[i, a, b], all_added[i, a, b] = transitions[i, a, b], added[i, a, b]
    for i in range(step.size):
        a, b, c, e = feedback[i, 0, 0], feedback[i, 0, 1], feedback[i, 1, 0], feedback[i, 1, 1]
        f, q = transitions[step[i]], added[step[i]]
        g, s = all_transitions[m + i], all_added[m + i]
        for j in range(3):
            g[0, j] = a * f[0, j] + b * f[1, j]
            g[1, j] = c * f[0, j] + e * f[1, j]
            g[2, j] = f[2, j]
        s[0, 0] = a * a * q[0, 0] + 2.0 * a * b * q[0, 1] + b * b * q[1, 1]
        s[0, 1] = a * c * q[0, 0] + (a * e + b * c) * q[0, 1] + b * e * q[1, 1]
        s[1, 1] = c * c * q[0, 0] + 2.0 * c * e * q[0, 1] + e * e * q[1, 1]
        s[0, 2] = a * q[0, 2] + b * q[1, 2]
        s[1, 2] = c * q[0, 2] + e * q[1, 2]
        s[2, 2] = q[2, 2]
        s[1, 0], s[2, 0], s[2, 1] = s[0, 1], s[0, 2], s[1, 2]
    return all_transitions, all_added


@njit(**INNER)
def _predicted(  # type: ignore[no-untyped-def]
    cov, f: Array, forced: Array, decay: float, added: float
):
    """The covariance one step later; of the symmetric 4 x 4 matrix the upper triangle, row by row.

    Written out: calls of BLAS on so small matrices take ten times as long, and arrays three times. The error
    of the sensor is the last state and no other drives it.
    """
    xx, xv, xd, xu, vv, vd, vu, dd, du, uu = cov
    a, b, p = f[0, 0], f[0, 1], f[0, 2]
    c, e, r = f[1, 0], f[1, 1], f[1, 2]
    s = f[2, 2]
    ax, av, ad = a * xx + b * xv + p * xd, a * xv + b * vv + p * vd, a * xd + b * vd + p * dd
    cx, cv, cd = c * xx + e * xv + r * xd, c * xv + e * vv + r * vd, c * xd + e * vd + r * dd
    return (
        ax * a + av * b + ad * p + forced[0, 0],
        cx * a + cv * b + cd * p + forced[0, 1],
        ad * s + forced[0, 2],
        (a * xu + b * vu + p * du) * decay,
        cx * c + cv * e + cd * r + forced[1, 1],
        cd * s + forced[1, 2],
        (c * xu + e * vu + r * du) * decay,
        s * dd * s + forced[2, 2],
        s * du * decay,
        decay * decay * uu + added,
    )


@njit(**INNER)
def _read(cov, row: Array, variance: float):  # type: ignore[no-untyped-def]
    """Covariances of the states with the sample, and the variance of its innovation."""
    xx, xv, xd, xu, vv, vd, vu, dd, du, uu = cov
    x = xx * row[0] + xv * row[1] + xd * row[2] + xu
    v = xv * row[0] + vv * row[1] + vd * row[2] + vu
    d = xd * row[0] + vd * row[1] + dd * row[2] + du
    u = xu * row[0] + vu * row[1] + du * row[2] + uu
    return x, v, d, u, row[0] * x + row[1] * v + row[2] * d + u + variance


@njit(**INNER)
def _learned(cov, x: float, v: float, d: float, u: float):  # type: ignore[no-untyped-def]
    """The covariance once a sample is known, from the gains of its innovation of unit variance."""
    xx, xv, xd, xu, vv, vd, vu, dd, du, uu = cov
    return (
        xx - x * x,
        xv - x * v,
        xd - x * d,
        xu - x * u,
        vv - v * v,
        vd - v * d,
        vu - v * u,
        dd - d * d,
        du - d * u,
        uu - u * u,
    )


@njit(**INNER)
def _same(first, second) -> bool:  # type: ignore[no-untyped-def]
    """Whether two covariances are the same to rounding, each entry over the two sds that it belongs to."""
    for j in range(10):
        a, b = _VARIANCES[j]
        if abs(first[j] - second[j]) > _ROUNDING * math.sqrt(first[a] * first[b]):
            return False
    return True


@njit(**KERNEL)
def filter_gains(
    force: ForcedSteps, error: ErrorSteps, rows: Array, variance: Array, predicted: Array
) -> Array:
    """Gains, shape (n, 5): of the four states for a whitened innovation, and one over the innovation's sd.

    All are zero of samples that are not used. ``predicted`` is filled with the covariances before each
    sample, unless it is empty. A covariance that is the same as one sample before stays the same until the
    step, the noise or the sensor's row changes.
    """
    index, transitions, forced, square = force
    decays, added, error_square = error
    gains = np.zeros((variance.size, 5))
    cov = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, square, 0.0, error_square)
    before, steady = cov, False
    changes = len(rows) > 1
    for i in range(variance.size):
        if i > 0:
            k = index[i - 1]
            steady = steady and k == index[i - 2]
            if not steady:
                after = _predicted(cov, transitions[k], forced[k], decays[k], added[k])
                steady = _same(after, before)
                before = after
            steady = steady and variance[i] == variance[i - 1]
            if changes:
                # what may change of a row is the slope of the restoring force
                steady = steady and rows[i, 0] == rows[i - 1, 0]
        if predicted.shape[0] > 0:
            place = 0
            for a in range(4):
                for b in range(a, 4):
                    predicted[i, a, b] = predicted[i, b, a] = before[place]
                    place += 1
        if steady:
            # one by one: assigning a row compiles numba's broadcasting, and its message, for three seconds
            for a in range(5):
                gains[i, a] = gains[i - 1, a]
        elif math.isfinite(variance[i]):
            x, v, d, u, total = _read(before, rows[i if changes else 0], variance[i])
            scale = 1.0 / math.sqrt(total)
            x, v, d, u = x * scale, v * scale, d * scale, u * scale
            cov = _learned(before, x, v, d, u)
            gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3], gains[i, 4] = x, v, d, u, scale
        else:
            cov = before
    return gains


@njit(**KERNEL)
def _log_determinant(gains: Array) -> tuple[float, int]:
    """Of the innovations' variances, and of how many samples that are used; a logarithm where one changes."""
    last = gains.shape[1] - 1
    total, log_scale, before, used = 0.0, 0.0, 0.0, ZERO
    for i in range(len(gains)):
        scale = gains[i, last]
        if scale > 0.0:
            if scale != before:
                before, log_scale = scale, math.log(scale)
            total += log_scale
            used += 1
    return -2.0 * total, used


@njit(**KERNEL, fastmath={"contract"})
def whitened_innovations(
    columns: Array, index: Indices, transitions: Array, decays: Array, rows: Array, gains: Array
) -> Array:
    """Whitened innovations of every column, zero in samples that are not used.

    A product and its sum in one instruction (``contract``) take half the time and round once less.
    """
    n, p = columns.shape
    white = np.zeros((n, p))
    x, v, d, u = np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p)
    changes = len(rows) > 1
    row0, row1, row2 = rows[0, 0], rows[0, 1], rows[0, 2]
    for i in range(n):
        # the states are zero before the first sample, whatever the step
        k = index[max(i - 1, 0)]
        f, decay = transitions[k], decays[k]
        f00, f01, f02, f10, f11, f12, f22 = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
        if changes:
            row0, row1, row2 = rows[i, 0], rows[i, 1], rows[i, 2]
        k0, k1, k2, k3, scale = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3], gains[i, 4]
        sample, innovation = columns[i], white[i]
        used = scale > 0.0
        for j in range(p):
            xj = f00 * x[j] + f01 * v[j] + f02 * d[j]
            vj = f10 * x[j] + f11 * v[j] + f12 * d[j]
            dj, uj = f22 * d[j], decay * u[j]
            e = (sample[j] - row0 * xj - row1 * vj - row2 * dj - uj) * scale if used else 0.0
            innovation[j] = e
            x[j] = xj + k0 * e
            v[j] = vj + k1 * e
            d[j] = dj + k2 * e
            u[j] = uj + k3 * e
    return white


@njit(**KERNEL, fastmath={"contract"})
def _coloured(
    white: Array, index: Indices, transitions: Array, decays: Array, rows: Array, gains: Array
) -> Array:
    """The samples of every column: the prediction plus the innovation."""
    n, p = white.shape
    columns = np.empty((n, p))
    x, v, d, u = np.zeros(p), np.zeros(p), np.zeros(p), np.zeros(p)
    changes = len(rows) > 1
    row0, row1, row2 = rows[0, 0], rows[0, 1], rows[0, 2]
    for i in range(n):
        k = index[max(i - 1, 0)]
        f, decay = transitions[k], decays[k]
        f00, f01, f02, f10, f11, f12, f22 = f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2]
        if changes:
            row0, row1, row2 = rows[i, 0], rows[i, 1], rows[i, 2]
        k0, k1, k2, k3, scale = gains[i, 0], gains[i, 1], gains[i, 2], gains[i, 3], gains[i, 4]
        sd = 1.0 / scale if scale > 0.0 else 0.0
        innovation, sample = white[i], columns[i]
        for j in range(p):
            xj = f00 * x[j] + f01 * v[j] + f02 * d[j]
            vj = f10 * x[j] + f11 * v[j] + f12 * d[j]
            dj, uj, e = f22 * d[j], decay * u[j], innovation[j]
            sample[j] = row0 * xj + row1 * vj + row2 * dj + uj + sd * e
            x[j] = xj + k0 * e
            v[j] = vj + k1 * e
            d[j] = dj + k2 * e
            u[j] = uj + k3 * e
    return columns


@njit(**INNER)
def _product(left: Array, right: Array, out: Array) -> Array:
    """Fill ``out = left' right``, an array other than the two, and return it; ``left`` is 4 x 4."""
    for b in range(right.shape[1]):
        for a in range(4):
            total = 0.0
            for c in range(4):
                total += left[c, a] * right[c, b]
            out[a, b] = total
    return out


@njit(**KERNEL)
def _looked_ahead(
    columns: Array, index: Indices, transitions: Array, decays: Array, rows: Array, gains: Array
) -> tuple[Array, Array]:
    """States of every column before each sample, shape (n, 4, p), and whitened innovations, (n, p)."""
    n, p = columns.shape
    changes = len(rows) > 1
    states = np.zeros((n, 4, p))
    innovations = np.zeros((n, p))
    now = np.zeros((4, p))
    for i in range(n):
        if i > 0:
            k = index[i - 1]
            f = transitions[k]
            for j in range(p):
                x, v, d = now[0, j], now[1, j], now[2, j]
                now[0, j] = f[0, 0] * x + f[0, 1] * v + f[0, 2] * d
                now[1, j] = f[1, 0] * x + f[1, 1] * v + f[1, 2] * d
                now[2, j] = f[2, 2] * d
                now[3, j] *= decays[k]
        for a in range(4):
            for j in range(p):
                states[i, a, j] = now[a, j]
        scale = gains[i, 4]
        if scale > 0.0:
            row = rows[i if changes else 0]
            for j in range(p):
                e = columns[i, j] - row[0] * now[0, j] - row[1] * now[1, j] - row[2] * now[2, j] - now[3, j]
                innovations[i, j] = e * scale
                for a in range(4):
                    now[a, j] += gains[i, a] * e * scale
    return states, innovations


@njit(**KERNEL)
def _looked_back(
    states: Array,
    innovations: Array,
    index: Indices,
    transitions: Array,
    decays: Array,
    rows: Array,
    gains: Array,
    predicted: Array,
) -> tuple[Array, Array, Array]:
    """States given all samples, in place, their covariance, and scores of a jump by later samples.

    These are of the force of the first column, shape (n, 2): the score of a jump by all later samples, and
    its information.
    """
    n, p = innovations.shape
    changes = len(rows) > 1
    f = np.zeros((4, 4))
    read = np.ones(4)
    adjoint, shift = np.zeros((4, p)), np.zeros((4, p))
    information, half = np.zeros((4, 4)), np.zeros((4, 4))
    carried = np.zeros(4)
    covariance = np.zeros((n, 4, 4))
    jumps = np.zeros((n, 2))
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            for a in range(3):
                for b in range(3):
                    f[a, b] = transitions[index[i], a, b]
            f[3, 3] = decays[index[i]]
            adjoint, shift = _product(f, adjoint, shift), adjoint
            information = _product(_product(information, f, half), f, information)
        scale = gains[i, 4]
        if scale > 0.0:
            # score and information of the later samples on the state before this one, and of this one itself
            both = scale * scale
            for a in range(3):
                read[a] = rows[i if changes else 0, a]
            for a in range(4):
                carried[a] = 0.0
                for b in range(4):
                    carried[a] += information[a, b] * gains[i, b] * scale
                both += carried[a] * gains[i, a] * scale
            for a in range(4):
                for b in range(4):
                    information[a, b] += (
                        read[a] * read[b] * both - carried[a] * read[b] - read[a] * carried[b]
                    )
            for j in range(p):
                rest = innovations[i, j]
                for a in range(4):
                    rest -= gains[i, a] * adjoint[a, j]
                for a in range(4):
                    adjoint[a, j] += read[a] * rest * scale
        jumps[i, 0], jumps[i, 1] = adjoint[2, 0], information[2, 2]
        _product(predicted[i], adjoint, shift)
        _product(predicted[i], _product(information, predicted[i], half), covariance[i])
        for a in range(4):
            for j in range(p):
                states[i, a, j] += shift[a, j]
            for b in range(4):
                covariance[i, a, b] = predicted[i, a, b] - covariance[i, a, b]
            # a difference: where almost everything is learned, rounding must not leave a negative variance
            covariance[i, a, a] = max(covariance[i, a, a], 0.0)
    return states, covariance, jumps
