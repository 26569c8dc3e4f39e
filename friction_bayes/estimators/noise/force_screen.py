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
from friction_bayes.statespace.transition import discretise

__all__ = ["ComparedForces", "ForceTable", "force_table", "probability_of_none"]

_LANES = 32
"""Forces side by side, of which the last may be none at all: so many compilers take several at a time."""
_COLUMNS = 3
"""Free motion from either state at the first sample, and a constant."""


class ComparedForces(NamedTuple):
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
    products : ndarray, shape (n + 1, 6 _LANES)
        Likewise sums ``aa, ab, bb, ac, bc, cc`` of products of the whitened columns over the first samples.
    log_determinants : ndarray, shape (n + 1, _LANES)
        Of the first samples.
    """

    step: float
    transitions: Array
    filters: Array
    products: Array
    log_determinants: Array


@njit(**KERNEL)
def force_table(step: float, n: int, row: Array, order: int, forces: ComparedForces) -> ForceTable:
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
    forces : ComparedForces
    """
    count = forces.ratio.size
    assert count <= _LANES
    transitions, forced, covariance = np.zeros(7 * _LANES), np.zeros(6 * _LANES), np.zeros(6 * _LANES)
    filters, log_determinants = np.empty((n, 7 * _LANES)), np.zeros((n + 1, _LANES))
    products = np.zeros((n + 1, 6 * _LANES))
    f, q = np.empty((3, 3)), np.empty((3, 3))
    for k in range(count):
        square = forces.ratio[k] ** 2
        discretise(step, 1.0, forces.tau[k], f, q)
        for j, entry in enumerate((f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2])):
            transitions[j * _LANES + k] = entry
        for j, entry in enumerate((q[0, 0], q[0, 1], q[0, 2], q[1, 1], q[1, 2], q[2, 2])):
            forced[j * _LANES + k] = square * entry
        covariance[5 * _LANES + k] = square
    whitened, innovation = np.zeros((_COLUMNS, 7 * _LANES)), np.empty(_LANES)
    for i in range(n):
        angle = i * step + 0.5 * math.pi * order
        own = filters[i]
        if i > 0:
            _predict(transitions, forced, covariance)
        _learn(row, covariance, own)
        # what is added up of a column with those that are not known yet is not used
        for j, value in enumerate((math.cos(angle), math.sin(angle), 1.0)):
            _advance(value, row, transitions, own, whitened[j], innovation)
            for k in range(_LANES):
                own[(4 + j) * _LANES + k] = innovation[k]
        _add_products(own, products[i], products[i + 1])
        for k in range(_LANES):
            log_determinants[i + 1, k] = log_determinants[i, k] - 2.0 * math.log(own[3 * _LANES + k])
    return ForceTable(step, transitions, filters, products, log_determinants)


@njit(**INNER, fastmath={"contract"})
def _predict(f: Array, forced: Array, covariance: Array) -> None:
    """Covariances of all forces, entries ``xx, xv, xd, vv, vd, dd``, one step later."""
    for k in range(_LANES):
        a, b, p = f[k], f[_LANES + k], f[2 * _LANES + k]
        c, e, r, s = f[3 * _LANES + k], f[4 * _LANES + k], f[5 * _LANES + k], f[6 * _LANES + k]
        xx, xv, xd = covariance[k], covariance[_LANES + k], covariance[2 * _LANES + k]
        vv, vd, dd = covariance[3 * _LANES + k], covariance[4 * _LANES + k], covariance[5 * _LANES + k]
        ax, av, ad = a * xx + b * xv + p * xd, a * xv + b * vv + p * vd, a * xd + b * vd + p * dd
        cx, cv, cd = c * xx + e * xv + r * xd, c * xv + e * vv + r * vd, c * xd + e * vd + r * dd
        covariance[k] = ax * a + av * b + ad * p + forced[k]
        covariance[_LANES + k] = cx * a + cv * b + cd * p + forced[_LANES + k]
        covariance[2 * _LANES + k] = ad * s + forced[2 * _LANES + k]
        covariance[3 * _LANES + k] = cx * c + cv * e + cd * r + forced[3 * _LANES + k]
        covariance[4 * _LANES + k] = cd * s + forced[4 * _LANES + k]
        covariance[5 * _LANES + k] = s * dd * s + forced[5 * _LANES + k]


@njit(**INNER, fastmath={"contract"})
def _learn(row: Array, covariance: Array, filters: Array) -> None:
    """Gains for one sample, and the covariances once it is known."""
    see_x, see_v, see_d = row[0], row[1], row[2]
    for k in range(_LANES):
        xx, xv, xd = covariance[k], covariance[_LANES + k], covariance[2 * _LANES + k]
        vv, vd, dd = covariance[3 * _LANES + k], covariance[4 * _LANES + k], covariance[5 * _LANES + k]
        x = xx * see_x + xv * see_v + xd * see_d
        v = xv * see_x + vv * see_v + vd * see_d
        d = xd * see_x + vd * see_v + dd * see_d
        scale = 1.0 / math.sqrt(see_x * x + see_v * v + see_d * d + 1.0)
        x, v, d = x * scale, v * scale, d * scale
        filters[k], filters[_LANES + k], filters[2 * _LANES + k], filters[3 * _LANES + k] = x, v, d, scale
        covariance[k], covariance[_LANES + k], covariance[2 * _LANES + k] = xx - x * x, xv - x * v, xd - x * d
        covariance[3 * _LANES + k], covariance[4 * _LANES + k] = vv - v * v, vd - v * d
        covariance[5 * _LANES + k] = dd - d * d


@njit(**INNER, fastmath={"contract"})
def _advance(value: float, row: Array, f: Array, filters: Array, sums: Array, innovation: Array) -> None:
    """Update the filters of all forces, side by side, with one sample.

    ``sums`` are the states, and those of the innovations with the columns and themselves; ``innovation``
    receives these.
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
        innovation[k] = e


@njit(**INNER, fastmath={"contract"})
def _add_products(filters: Array, before: Array, products: Array) -> None:
    """Fill in sums of products of the whitened columns with one sample more."""
    for k in range(_LANES):
        a, b, c = filters[4 * _LANES + k], filters[5 * _LANES + k], filters[6 * _LANES + k]
        products[k] = before[k] + a * a
        products[_LANES + k] = before[_LANES + k] + a * b
        products[2 * _LANES + k] = before[2 * _LANES + k] + b * b
        products[3 * _LANES + k] = before[3 * _LANES + k] + a * c
        products[4 * _LANES + k] = before[4 * _LANES + k] + b * c
        products[5 * _LANES + k] = before[5 * _LANES + k] + c * c


@njit(**KERNEL)
def probability_of_none(residual: Array, row: Array, forces: ComparedForces, table: ForceTable) -> float:
    """Probability that no force acts, from a residual, shape (m,), of at most the table's samples.

    Its free motion, a constant and the noise are integrated out under a flat prior.
    """
    n, count = residual.size, forces.ratio.size
    sums, innovation, products = np.zeros(7 * _LANES), np.empty(_LANES), table.products[n]
    for i in range(n):
        _advance(residual[i], row, table.transitions, table.filters[i], sums, innovation)
    moments = sums[3 * _LANES :].reshape(4, _LANES)
    freedom = n - _COLUMNS
    log_weight = np.empty(count)
    for k in range(count):
        aa, ab, bb = products[k], products[_LANES + k], products[2 * _LANES + k]
        ac, bc, cc = products[3 * _LANES + k], products[4 * _LANES + k], products[5 * _LANES + k]
        # the Cholesky factor of the products of columns and residual
        a = math.sqrt(aa)
        b, c, r = ab / a, ac / a, moments[0, k] / a
        bb = math.sqrt(bb - b * b)
        cb, rb = (bc - c * b) / bb, (moments[1, k] - r * b) / bb
        cc = math.sqrt(cc - c * c - cb * cb)
        rc = (moments[2, k] - r * c - rb * cb) / cc
        rest = moments[3, k] - r * r - rb * rb - rc * rc
        log_weight[k] = forces.log_prior[k] - 0.5 * (freedom * math.log(rest) + table.log_determinants[n, k])
        log_weight[k] -= math.log(a * bb * cc)
    total = 0.0
    for k in range(count):
        total += math.exp(log_weight[k] - log_weight[0])
    return 1.0 / total
