r"""The probability that no force acts in addition to white noise, even sampling, by filters records share.

The gains of a filter, and what it makes of the columns of the free motion, depend on the clock alone. For
records of one system that is one table for all, and a record costs one run of every filter over itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.transition import discretise

__all__ = ["ComparedForces", "ForceTable", "force_table", "probability_of_none"]

_LANES = 32
"""Forces side by side, of which the last may be none at all: so many compilers take several at a time."""
_STEADY = 1e-13
"""Change of a gain from one sample to the next, relative or of a noise of unit sd, when it has settled."""
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
    gains : ndarray, shape (n, 4 _LANES)
        Likewise gains of displacement, velocity and force for a whitened innovation, and one over the
        innovation's sd.
    log_determinants : ndarray, shape (n, _LANES)
        Of the samples up to each.
    settled : int
        How many of either are filled in: the gains of the last of them are those of all that follow.
    columns : ndarray, shape (n, 3 _LANES)
        The columns, whitened.
    products : ndarray, shape (6 _LANES,)
        Sums ``aa, ab, bb, ac, bc, cc`` of their products.
    """

    step: float
    transitions: Array
    gains: Array
    log_determinants: Array
    settled: int
    columns: Array
    products: Array


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
    gains, log_determinants = np.empty((n, 4 * _LANES)), np.empty((n, _LANES))
    columns, products = np.empty((n, _COLUMNS * _LANES)), np.zeros(6 * _LANES)
    f, q = np.empty((3, 3)), np.empty((3, 3))
    for k in range(count):
        square = forces.ratio[k] ** 2
        discretise(step, 1.0, forces.tau[k], f, q)
        for j, entry in enumerate((f[0, 0], f[0, 1], f[0, 2], f[1, 0], f[1, 1], f[1, 2], f[2, 2])):
            transitions[j * _LANES + k] = entry
        for j, entry in enumerate((q[0, 0], q[0, 1], q[0, 2], q[1, 1], q[1, 2], q[2, 2])):
            forced[j * _LANES + k] = square * entry
        covariance[5 * _LANES + k] = square
    states = np.zeros((_COLUMNS, 3 * _LANES))
    settled, steady = 0, False
    for i in range(n):
        angle = i * step + 0.5 * math.pi * order
        if not steady:
            settled = i + 1
            if i > 0:
                _predict(transitions, forced, covariance)
            _learn(row, covariance, gains[i])
            for k in range(_LANES):
                log_determinants[i, k] = -2.0 * math.log(gains[i, 3 * _LANES + k])
                if i > 0:
                    log_determinants[i, k] += log_determinants[i - 1, k]
            steady = i > 0 and _close(gains[i], gains[i - 1])
        own = columns[i]
        for j, value in enumerate((math.cos(angle), math.sin(angle), 1.0)):
            whitened = own[j * _LANES : (j + 1) * _LANES]
            _advance(value, row, transitions, gains[settled - 1], states[j], whitened)
        _add_products(own, products)
    return ForceTable(step, transitions, gains, log_determinants, settled, columns, products)


@njit(**INNER)
def _close(gains: Array, before: Array) -> bool:
    """Whether the gains of all forces, and one over the innovation's sd, are what they were to rounding."""
    most = 0.0
    for k in range(4 * _LANES):
        most = max(most, abs(gains[k] - before[k]) / (1.0 + abs(gains[k])))
    return most <= _STEADY


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
def _learn(row: Array, covariance: Array, gains: Array) -> None:
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
        gains[k], gains[_LANES + k], gains[2 * _LANES + k], gains[3 * _LANES + k] = x, v, d, scale
        covariance[k], covariance[_LANES + k], covariance[2 * _LANES + k] = xx - x * x, xv - x * v, xd - x * d
        covariance[3 * _LANES + k], covariance[4 * _LANES + k] = vv - v * v, vd - v * d
        covariance[5 * _LANES + k] = dd - d * d


@njit(**INNER, fastmath={"contract"})
def _advance(value: float, row: Array, f: Array, gains: Array, states: Array, innovation: Array) -> None:
    """Update the filters of all forces, side by side, with one sample; ``innovation`` receives theirs."""
    see_x, see_v, see_d = row[0], row[1], row[2]
    for k in range(_LANES):
        x, v, d = states[k], states[_LANES + k], states[2 * _LANES + k]
        ahead_x = f[k] * x + f[_LANES + k] * v + f[2 * _LANES + k] * d
        ahead_v = f[3 * _LANES + k] * x + f[4 * _LANES + k] * v + f[5 * _LANES + k] * d
        ahead_d = f[6 * _LANES + k] * d
        e = (value - see_x * ahead_x - see_v * ahead_v - see_d * ahead_d) * gains[3 * _LANES + k]
        states[k] = ahead_x + gains[k] * e
        states[_LANES + k] = ahead_v + gains[_LANES + k] * e
        states[2 * _LANES + k] = ahead_d + gains[2 * _LANES + k] * e
        innovation[k] = e


@njit(**INNER, fastmath={"contract"})
def _add_innovation(columns: Array, innovation: Array, sums: Array) -> None:
    """Add the products of a whitened sample with the whitened columns there, and its square."""
    for k in range(_LANES):
        e = innovation[k]
        sums[k] += columns[k] * e
        sums[_LANES + k] += columns[_LANES + k] * e
        sums[2 * _LANES + k] += columns[2 * _LANES + k] * e
        sums[3 * _LANES + k] += e * e


@njit(**INNER, fastmath={"contract"})
def _add_products(columns: Array, products: Array) -> None:
    """Add the products of the whitened columns at one sample."""
    for k in range(_LANES):
        a, b, c = columns[k], columns[_LANES + k], columns[2 * _LANES + k]
        products[k] += a * a
        products[_LANES + k] += a * b
        products[2 * _LANES + k] += b * b
        products[3 * _LANES + k] += a * c
        products[4 * _LANES + k] += b * c
        products[5 * _LANES + k] += c * c


@njit(**KERNEL)
def probability_of_none(residual: Array, row: Array, forces: ComparedForces, table: ForceTable) -> float:
    """Probability that no force acts, from a residual, shape (m,), of at most the table's samples.

    Its free motion, a constant and the noise are integrated out under a flat prior.
    """
    n, count = residual.size, forces.ratio.size
    states, sums, innovation = np.zeros(3 * _LANES), np.zeros(4 * _LANES), np.empty(_LANES)
    for i in range(n):
        gains = table.gains[min(i, table.settled - 1)]
        _advance(residual[i], row, table.transitions, gains, states, innovation)
        _add_innovation(table.columns[i], innovation, sums)
    products = table.products
    if n < len(table.columns):
        products = np.zeros(6 * _LANES)
        for i in range(n):
            _add_products(table.columns[i], products)
    last = min(n, table.settled) - 1
    moments = sums.reshape(4, _LANES)
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
        log_determinant = table.log_determinants[last, k]
        log_determinant -= 2.0 * (n - 1 - last) * math.log(table.gains[last, 3 * _LANES + k])
        log_weight[k] = forces.log_prior[k] - 0.5 * (freedom * math.log(rest) + log_determinant)
        log_weight[k] -= math.log(a * bb * cc)
    total = 0.0
    for k in range(count):
        total += math.exp(log_weight[k] - log_weight[0])
    return 1.0 / total
