r"""The probability that no force acts beside white noise on an even clock, by filters that records share.

The gains of a filter, and what it makes of the columns of the free motion, depend on the clock alone. For
records of one system that is one table for all, and a record costs one run of every filter over itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import KERNEL
from friction_bayes.statespace.kalman import ErrorSteps, filter_gains, whitened_innovations
from friction_bayes.statespace.transition import ForcedSteps, discretise

__all__ = ["ForceTable", "ForcesBeside", "force_table", "probability_of_none"]

_COLUMNS = 3
"""Free motion from either state at the first sample, and a constant."""


class ForcesBeside(NamedTuple):
    """Forces to be compared with none, shape (forces,) each; the first of them is none.

    Attributes
    ----------
    ratio : ndarray
        Standard deviation over that of the noise; zero for none.
    tau : ndarray
        Correlation time, as a phase.
    log_prior : ndarray
        Logarithm of its prior probability.
    """

    ratio: Array
    tau: Array
    log_prior: Array


class ForceTable(NamedTuple):
    """Filters of an even clock for every force.

    Attributes
    ----------
    step : float
        Phase from one sample to the next.
    transitions : ndarray, shape (forces, 7)
        Entries ``00, 01, 02, 10, 11, 12, 22`` of each.
    gains : ndarray, shape (n, forces, 4)
        Of displacement, velocity and force for a whitened innovation, and one over the innovation's sd.
    columns : ndarray, shape (n, forces, 3)
        The columns, whitened.
    sums : ndarray, shape (n + 1, forces, 7)
        Over the first samples: products ``aa, ab, bb, ac, bc, cc`` of the whitened columns, and the log
        determinant.
    """

    step: float
    transitions: Array
    gains: Array
    columns: Array
    sums: Array


@njit(**KERNEL)
def force_table(step: float, n: int, row: Array, order: int, forces: ForcesBeside) -> ForceTable:
    """Prepare the filters of ``n`` samples.

    Parameters
    ----------
    step : float
        Phase from one sample to the next.
    n : int
        Samples.
    row : ndarray, shape (3,)
        From :func:`friction_bayes.statespace.kalman.sensor_row`.
    order : int
        Order of the derivative measured.
    forces : ForcesBeside
    """
    count = forces.ratio.size
    transitions, gains, sums = np.empty((count, 7)), np.empty((n, count, 4)), np.zeros((n + 1, count, 7))
    whitened, columns = np.empty((n, count, _COLUMNS)), np.ones((n, _COLUMNS))
    for i in range(n):
        angle = i * step + 0.5 * math.pi * order
        columns[i, 0], columns[i, 1] = math.cos(angle), math.sin(angle)
    index, variance, rows = np.zeros(n - 1, np.int64), np.ones(n), row.reshape(1, 3)
    error = ErrorSteps(np.zeros(1), np.zeros(1), 0.0)
    transition, covariance = np.empty((1, 3, 3)), np.empty((1, 3, 3))
    for k in range(count):
        square = forces.ratio[k] ** 2
        discretise(step, 1.0, forces.tau[k], transition[0], covariance[0])
        forced = ForcedSteps(index, transition, square * covariance, square)
        own = filter_gains(forced, error, rows, variance, np.empty((0, 4, 4)))
        white = whitened_innovations(columns, index, transition, error.decays, rows, own)
        f = transition[0]
        transitions[k, 0], transitions[k, 1], transitions[k, 2] = f[0, 0], f[0, 1], f[0, 2]
        transitions[k, 3], transitions[k, 4], transitions[k, 5] = f[1, 0], f[1, 1], f[1, 2]
        transitions[k, 6] = f[2, 2]
        for i in range(n):
            gains[i, k, 0], gains[i, k, 1], gains[i, k, 2] = own[i, 0], own[i, 1], own[i, 2]
            gains[i, k, 3] = own[i, 4]
            a, b, c = white[i, 0], white[i, 1], white[i, 2]
            whitened[i, k, 0], whitened[i, k, 1], whitened[i, k, 2] = a, b, c
            products = (a * a, a * b, b * b, a * c, b * c, c * c, -2.0 * math.log(own[i, 4]))
            for j in range(7):
                sums[i + 1, k, j] = sums[i, k, j] + products[j]
    return ForceTable(step, transitions, gains, whitened, sums)


@njit(**KERNEL, fastmath={"contract"})
def probability_of_none(residual: Array, row: Array, forces: ForcesBeside, table: ForceTable) -> float:
    """Probability that no force acts on what has this residual, shape (m,), of at most the table's samples.

    Its free motion, a constant and the noise are integrated out under a flat prior.
    """
    n, count = residual.size, forces.ratio.size
    f, gains, columns = table.transitions, table.gains, table.columns
    states, moments = np.zeros((count, 3)), np.zeros((count, 4))
    for i in range(n):
        for k in range(count):
            x = f[k, 0] * states[k, 0] + f[k, 1] * states[k, 1] + f[k, 2] * states[k, 2]
            v = f[k, 3] * states[k, 0] + f[k, 4] * states[k, 1] + f[k, 5] * states[k, 2]
            d = f[k, 6] * states[k, 2]
            e = (residual[i] - row[0] * x - row[1] * v - row[2] * d) * gains[i, k, 3]
            states[k, 0] = x + gains[i, k, 0] * e
            states[k, 1] = v + gains[i, k, 1] * e
            states[k, 2] = d + gains[i, k, 2] * e
            for j in range(_COLUMNS):
                moments[k, j] += columns[i, k, j] * e
            moments[k, 3] += e * e
    freedom = n - _COLUMNS
    log_weight = np.empty(count)
    for k in range(count):
        aa, ab, bb, ac, bc, cc, log_determinant = table.sums[n, k]
        # the Cholesky factor of the products of columns and residual
        a = math.sqrt(aa)
        b, c, r = ab / a, ac / a, moments[k, 0] / a
        bb = math.sqrt(bb - b * b)
        cb, rb = (bc - c * b) / bb, (moments[k, 1] - r * b) / bb
        cc = math.sqrt(cc - c * c - cb * cb)
        rc = (moments[k, 2] - r * c - rb * cb) / cc
        rest = moments[k, 3] - r * r - rb * rb - rc * rc
        log_weight[k] = forces.log_prior[k] - 0.5 * (freedom * math.log(rest) + log_determinant)
        log_weight[k] -= math.log(a * bb * cc)
    total = 0.0
    for k in range(count):
        total += math.exp(log_weight[k] - log_weight[0])
    return 1.0 / total
