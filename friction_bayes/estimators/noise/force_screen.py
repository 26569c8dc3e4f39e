r"""The probability that no force acts in addition to white noise, even sampling, by filters records share.

The gains of a filter, and what it makes of the columns of the free motion, depend on the clock alone. For
records of one system that is one table for all, and a record costs one run of every filter over itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL
from friction_bayes.statespace.kalman import ErrorSteps, filter_gains, whitened_innovations
from friction_bayes.statespace.transition import ForcedSteps, discretise

__all__ = ["ForceTable", "ForcesBeside", "force_table", "probability_of_none"]

_LANES = 32
"""Forces side by side, of which the last may be none at all: so many compilers take several at a time."""
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
    transitions : ndarray, shape (7 _LANES,)
        Entries ``00, 01, 02, 10, 11, 12, 22`` of all, one after the other.
    filters : ndarray, shape (n, 7 _LANES)
        Likewise gains of displacement, velocity and force for a whitened innovation, one over the
        innovation's sd, and the columns, whitened.
    sums : ndarray, shape (n + 1, forces, 7)
        Over the first samples: products ``aa, ab, bb, ac, bc, cc`` of the whitened columns, and the log
        determinant.
    """

    step: float
    transitions: Array
    filters: Array
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
    assert count <= _LANES
    transitions, filters, sums = np.zeros(7 * _LANES), np.zeros((n, 7 * _LANES)), np.zeros((n + 1, count, 7))
    each, columns = np.empty((count, n, 8)), np.ones((n, _COLUMNS))
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
        for j, entry in enumerate((f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2])):
            transitions[j * _LANES + k] = entry
        for i in range(n):
            each[k, i, 0], each[k, i, 1], each[k, i, 2], each[k, i, 3] = (
                own[i, 0],
                own[i, 1],
                own[i, 2],
                own[i, 4],
            )
            each[k, i, 4], each[k, i, 5], each[k, i, 6] = white[i, 0], white[i, 1], white[i, 2]
    # sample by sample, as memory has it
    for i in range(n):
        for k in range(count):
            for j in range(7):
                filters[i, j * _LANES + k] = each[k, i, j]
            scale, a, b, c = each[k, i, 3], each[k, i, 4], each[k, i, 5], each[k, i, 6]
            products = (a * a, a * b, b * b, a * c, b * c, c * c, -2.0 * math.log(scale))
            for j in range(7):
                sums[i + 1, k, j] = sums[i, k, j] + products[j]
    return ForceTable(step, transitions, filters, sums)


@njit(**INNER, fastmath={"contract"})
def _advance(value: float, row: Array, f: Array, filters: Array, sums: Array) -> None:
    """Update the filters of all forces, side by side, with one sample.

    ``sums`` are the states, and those of the innovations with the columns and themselves.
    """
    see_x, see_v, see_d = row[0], row[1], row[2]
    for k in range(_LANES):
        x, v, d = sums[k], sums[_LANES + k], sums[2 * _LANES + k]
        ahead_x = f[k] * x + f[_LANES + k] * v + f[2 * _LANES + k] * d
        ahead_v = f[3 * _LANES + k] * x + f[4 * _LANES + k] * v + f[5 * _LANES + k] * d
        ahead_d = f[6 * _LANES + k] * d
        e = (value - see_x * ahead_x - see_v * ahead_v - see_d * ahead_d) * filters[3 * _LANES + k]
        sums[k] = ahead_x + filters[k] * e
        sums[_LANES + k] = ahead_v + filters[_LANES + k] * e
        sums[2 * _LANES + k] = ahead_d + filters[2 * _LANES + k] * e
        sums[3 * _LANES + k] += filters[4 * _LANES + k] * e
        sums[4 * _LANES + k] += filters[5 * _LANES + k] * e
        sums[5 * _LANES + k] += filters[6 * _LANES + k] * e
        sums[6 * _LANES + k] += e * e


@njit(**KERNEL)
def probability_of_none(residual: Array, row: Array, forces: ForcesBeside, table: ForceTable) -> float:
    """Probability that no force acts, from a residual, shape (m,), of at most the table's samples.

    Its free motion, a constant and the noise are integrated out under a flat prior.
    """
    n, count = residual.size, forces.ratio.size
    sums = np.zeros(7 * _LANES)
    for i in range(n):
        _advance(residual[i], row, table.transitions, table.filters[i], sums)
    moments = sums[3 * _LANES :].reshape(4, _LANES)
    freedom = n - _COLUMNS
    log_weight = np.empty(count)
    for k in range(count):
        aa, ab, bb, ac, bc, cc, log_determinant = table.sums[n, k]
        # the Cholesky factor of the products of columns and residual
        a = math.sqrt(aa)
        b, c, r = ab / a, ac / a, moments[0, k] / a
        bb = math.sqrt(bb - b * b)
        cb, rb = (bc - c * b) / bb, (moments[1, k] - r * b) / bb
        cc = math.sqrt(cc - c * c - cb * cb)
        rc = (moments[2, k] - r * c - rb * cb) / cc
        rest = moments[3, k] - r * r - rb * rb - rc * rc
        log_weight[k] = forces.log_prior[k] - 0.5 * (freedom * math.log(rest) + log_determinant)
        log_weight[k] -= math.log(a * bb * cc)
    total = 0.0
    for k in range(count):
        total += math.exp(log_weight[k] - log_weight[0])
    return 1.0 / total
