r"""Every set of columns of a regression evaluated on one whitened Gram matrix.

Given size and correlation time of the random force the record is ``y = X b + noise`` with known sums
``G = X' inv(V) X``. Columns come multiplied by the prior sd of their coefficient, so that ``b ~ N(0, 1)`` for
all of them, half-normal where the coefficient has to be positive. With ``p(sigma**2) = 1/sigma**2`` and the
prior precision in units of the noise, ``lam = s**2`` with ``s**2`` the noise variance found with all columns,

.. math:: \log p(y|S) = -\tfrac12\log|V| + \tfrac{|S|}{2}\log\lambda - \tfrac12\log|G_{SS}+\lambda I|
          - \tfrac n2 \log\tfrac{R_S}{2} + \sum_{j\in P}\log 2 + \log P(b_P > 0\,|\,y)

where ``R_S`` is the penalised sum of squares and the last two terms truncate prior and posterior at zero. The
data are the residual of a reference law, so that no large numbers are subtracted. The coefficients are taken
as normal, with the noise variance ``R_S/n``: ``n`` is hundreds at least. Where that would be below the
sensor's rounding, the noise has that variance: the likelihood of ``R_S`` at it takes the place of the
integral.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.linalg.lapack import dposv

from friction_bayes.core.arrays import ZERO, Array, Indices, Integers, Mask
from friction_bayes.core.kernels import INNER, KERNEL, njit
from friction_bayes.statespace.cholesky import factor, forward
from friction_bayes.statespace.kalman import Whitened
from friction_bayes.statespace.positive_orthant import VECTORS, confine, confine_all, cut_moments

__all__ = [
    "NestedSets",
    "SetEvidences",
    "bound_sets",
    "evaluate_bounded",
    "evaluate_sets",
    "full_noise2",
    "nest",
    "set_marginals",
    "set_mean",
    "set_posterior",
    "solved",
]

_NEGLIGIBLE = 12.0
"""Nats below the best at which a set's mass of positive coefficients is not computed any more."""
_LEFT_OUT = 1e3
"""Nats by which such sets are lowered."""
_OFTEN = 0.25
"""Share of the sets that contain a column above which it is one of the first."""
_LEAST = 1e-300
_Values = TypeVar("_Values", Array, Mask)


class SetEvidences(NamedTuple):
    """Evidences of sets, from :func:`evaluate_sets`, or bounds of them, and their noise variances.

    Attributes
    ----------
    log_weight : ndarray, shape (m,)
        Log evidence plus log prior probability; far too low for sets that cannot matter, where a coefficient
        has to be positive.
    noise2 : ndarray, shape (m,)
        Noise variance in each set.
    full_noise2 : float
        Noise variance with all columns.
    """

    log_weight: Array
    noise2: Array
    full_noise2: float

    @property
    def log_total(self) -> float:
        """Logarithm of the sum of the weights, to which the sets that were left out add nothing."""
        if self.log_weight.size == 1:
            return float(self.log_weight[0])
        counts = self.log_weight > self.log_weight.max() - _LEFT_OUT
        return float(np.logaddexp.reduce(self.log_weight[counts]))

    def holding(self, mass: float) -> Mask:
        """The most probable sets that hold so much of the probability, shape (m,)."""
        order = np.argsort(-self.log_weight)
        before = np.cumsum(np.exp(self.log_weight[order] - self.log_total))
        held = np.zeros(order.size, np.bool_)
        held[order[: np.searchsorted(before, mass) + 1]] = True
        return held


class NestedSets(NamedTuple):
    """Sets of columns in the order that is fastest for :func:`bound_sets`.

    Attributes
    ----------
    columns : ndarray of int, shape (p,)
        The columns as they are eliminated.
    order : ndarray of int, shape (m,)
        Of the sets: those that begin alike follow each other.
    inside : ndarray of bool, shape (m, p)
        Which of these columns each set holds, in this order of the sets.
    first : ndarray of int, shape (m,)
        The first of these columns in which each differs from the one before it; zero for the first set, p for
        one that is the same.
    """

    columns: Indices
    order: Indices
    inside: Mask
    first: Indices

    @classmethod
    def of(cls, columns: Indices, order: Indices, inside: Mask) -> NestedSets:
        """From the other fields."""
        differ = np.ones((len(order), columns.size + 1), np.bool_)
        differ[1:, :-1] = inside[1:] != inside[:-1]
        return cls(columns, order, _read_only(inside), differ.argmax(axis=1))


class _Regression(NamedTuple):
    """Whitened sums of the columns and the record about a reference law; fields as of :func:`bound_sets`."""

    gram: Array
    log_determinant: float
    used: int
    reference: Array
    positive: Mask


class _NormalEquations(NamedTuple):
    """Those of a set: their factor, half of the solution, the columns they are of, and how many."""

    lower: Array
    half: Array
    columns: Integers
    size: int


def nest(sets: Mask) -> NestedSets:
    """Nest sets of columns, shape (m, p).

    Columns of many sets come first, the commonest before all, then the others from the rarest on: two
    sets that follow each other part late, where few columns are left to differ in.
    """
    return _nested(sets.tobytes(), sets.shape)


@lru_cache(maxsize=8)
def _nested(rows: bytes, shape: tuple[int, int]) -> NestedSets:
    """Of sets as bytes: rounds and motions of one record have the same."""
    sets = np.frombuffer(rows, np.bool_).reshape(shape)
    share = sets.mean(axis=0)
    often = share >= _OFTEN
    columns = np.lexsort((np.where(often, -share, share), ~often))
    inside = sets[:, columns]
    order = np.lexsort(np.packbits(inside, axis=1).T[::-1])
    return NestedSets.of(columns, order, inside[order])


def _read_only(array: _Values) -> _Values:
    """Read-only view, as the stored arrays are read-only: numba compiles for one kind alone."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


def full_noise2(whitened: Whitened) -> float:
    """Noise variance of least squares with all columns, of sums as :func:`evaluate_sets` takes them."""
    p = len(whitened.gram) - 1
    return float(_full_noise(whitened.gram, whitened.used, np.empty((p, p)), np.empty(p)))


def solved(matrix: Array, right: Array) -> Array:
    """Solution for a few unknowns by Cholesky's factors: SciPy's wrappers of LAPACK take longer."""
    _, solution, failed = dposv(matrix, right)
    if failed:
        raise np.linalg.LinAlgError(f"no Cholesky factor: order {failed} of {len(matrix)}")
    return np.asarray(solution)


def set_marginals(mean: Array, covariance: Array, columns: Mask, positive: Mask) -> tuple[Array, Array]:
    """Marginals of a set's coefficients, those that have to be positive before they are cut at zero.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (s,), (s, s)
        From :func:`set_posterior`.
    columns, positive : ndarray of bool, shape (p,)
        The set, and which coefficients have to be positive.

    Returns
    -------
    location, scale2 : ndarray, shape (p,)
        As in :func:`friction_bayes.statespace.positive_orthant.confine`; nan where the set lacks
        the column.
    """
    where, spread = np.empty_like(mean), np.empty_like(mean)
    confine(mean, covariance, positive[columns], where, spread)
    location, scale2 = np.full((2, columns.size), np.nan)
    location[columns], scale2[columns] = where, spread
    return location, scale2


def bound_sets(
    whitened: Whitened,
    reference: Array,
    positive: Mask,
    sets: Mask,
    log_prior: Array,
    *,
    least_noise2: float = 0.0,
    lam: float | None = None,
    nested: NestedSets | None = None,
) -> SetEvidences:
    """Upper bounds of the weights of all sets, at much less cost than evaluating them.

    Those that they would have if all positive coefficients were sure to be.

    Parameters
    ----------
    whitened : Whitened
        Sums of ``[X | y - X reference]``, p + 1 columns.
    reference : ndarray, shape (p,)
        Reference law.
    positive : ndarray of bool, shape (p,)
        Which coefficients have to be positive.
    sets : ndarray of bool, shape (m, p)
        The columns in each set.
    log_prior : ndarray, shape (m,)
        Log prior probabilities of the sets.
    least_noise2 : float
        Least noise variance.
    lam : float, optional
        Noise variance with all columns, where there are more than these.
    nested : NestedSets, optional
        The sets from :func:`nest`: much faster than in arbitrary order.
    """
    full = max(full_noise2(whitened), least_noise2) if lam is None else lam
    if nested is None:
        nested = NestedSets.of(np.arange(reference.size), np.arange(len(sets)), sets)
    regression = _Regression(whitened.gram, whitened.log_determinant, whitened.used, reference, positive)
    log_weight, noise2 = _bound_sets(regression, nested, _read_only(log_prior), full, least_noise2)
    return SetEvidences(log_weight, noise2, full)


def evaluate_sets(
    whitened: Whitened,
    reference: Array,
    positive: Mask,
    sets: Mask,
    log_prior: Array,
    *,
    least_noise2: float = 0.0,
) -> SetEvidences:
    """Evidences of all sets; parameters as of :func:`bound_sets`."""
    bounds = bound_sets(whitened, reference, positive, sets, log_prior, least_noise2=least_noise2)
    return evaluate_bounded(whitened, reference, positive, sets, bounds)


def evaluate_bounded(
    whitened: Whitened,
    reference: Array,
    positive: Mask,
    sets: Mask,
    bounds: SetEvidences,
    best: float = -math.inf,
) -> SetEvidences:
    """Evidences of the sets that may matter, given upper bounds of all weights.

    Parameters
    ----------
    whitened, reference, positive, sets
        As :func:`bound_sets` takes them.
    bounds : SetEvidences
        Its result.
    best : float
        Log weight of a set that is not among these, compared with which they may not matter.
    """
    if not positive.any():
        return bounds
    regression = _Regression(whitened.gram, whitened.log_determinant, whitened.used, reference, positive)
    bound, log_weight = bounds.log_weight, bounds.log_weight - _LEFT_OUT
    highest = np.array([bound.argmax()])
    if bound[highest[0]] < best - _NEGLIGIBLE:
        return bounds._replace(log_weight=log_weight)
    sets = _read_only(sets)
    best = _evaluate_sets(regression, sets, highest, bounds, best, log_weight)
    # few are left to sort once one is known
    others = np.flatnonzero(bound >= best - _NEGLIGIBLE)
    others = others[others != highest]
    if others.size > 0:
        _evaluate_sets(regression, sets, others[np.argsort(-bound[others])], bounds, best, log_weight)
    return bounds._replace(log_weight=log_weight)


@njit(**KERNEL)
def _full_noise(gram: Array, used: int, work: Array, half: Array) -> float:
    """Noise variance of least squares with all columns."""
    p = work.shape[0]
    right = np.empty(p)
    for i in range(p):
        right[i] = gram[i, p]
        for j in range(p):
            work[i, j] = gram[i, j]
        # columns may be the same to rounding
        work[i, i] += 1e-12 * gram[i, i] + _LEAST
    factor(work, p)
    explained = forward(work, right, p, half)
    return max(gram[p, p] - explained, _LEAST) / max(used - p, 1)


@njit(**KERNEL)
def _bound_sets(
    regression: _Regression, nested: NestedSets, log_prior: Array, lam: float, least_noise2: float
) -> tuple[Array, Array]:
    """Bounds and noise variances, from the sums after elimination of a set's columns in turn.

    A set begins where it differs from the one before it. Step ``k`` takes column ``column[k]``
    into the set, or, where the set lacks it, what the reference has of it back into the record. The arrays
    hold what is known after so many steps; the sums themselves only after ``known``, since the last column
    of a set is rarely the last but one of the next.
    """
    gram, log_determinant, used = regression.gram, regression.log_determinant, regression.used
    columns, order, sets, begins = nested
    m, p = sets.shape
    left = np.empty((p + 1, p + 1, p + 1))
    place, reference, positive = np.full(p + 1, p), np.empty(p), np.empty(p, np.bool_)
    for a in range(p):
        place[a] = columns[a]
        reference[a], positive[a] = regression.reference[columns[a]], regression.positive[columns[a]]
    for a in range(p + 1):
        for b in range(p + 1):
            left[0, a, b] = gram[place[a], place[b]]
    column, steps = np.empty(p, np.int64), np.zeros(p + 1, np.int64)
    square, log_factor, size, confined = np.zeros(p + 1), np.zeros(p + 1), np.zeros(p + 1), np.zeros(p + 1)
    square[0] = gram[p, p]
    bound, noise2 = np.empty(m), np.empty(m)
    share = np.empty(p)
    known = 0
    for i in range(m):
        s, first = order[i], begins[i]
        k = steps[first]
        known = min(known, k)
        for j in range(first, p):
            steps[j] = k
            if sets[i, j] or reference[j] != 0.0:
                if known < k:
                    _take_step(left, k, column[k - 1], sets[i, column[k - 1]], reference, lam, share)
                    known = k
                own, shared = left[k, j, j], left[k, j, p]
                if sets[i, j]:
                    own += lam
                    shared -= lam * reference[j]
                    square[k + 1] = square[k] + lam * reference[j] ** 2 - shared * shared / max(own, _LEAST)
                    log_factor[k + 1] = log_factor[k] + math.log(max(own, _LEAST))
                    size[k + 1], confined[k + 1] = size[k] + 1.0, confined[k] + positive[j]
                else:
                    square[k + 1] = square[k] + reference[j] * (2.0 * shared + reference[j] * own)
                    log_factor[k + 1], size[k + 1], confined[k + 1] = log_factor[k], size[k], confined[k]
                column[k] = j
                k += 1
        steps[p] = k
        total = max(square[k], _LEAST)
        noise2[s] = max(total / used, least_noise2)
        bound[s] = log_prior[s] - 0.5 * log_determinant
        bound[s] -= 0.5 * (used * math.log(0.5 * used * noise2[s]) + total / noise2[s] - used)
        bound[s] += 0.5 * size[k] * math.log(lam) - 0.5 * log_factor[k] + math.log(2.0) * confined[k]
    return bound, noise2


@njit(**INNER)
def _take_step(left: Array, k: int, j: int, taken: bool, reference: Array, lam: float, share: Array) -> None:
    """Fill the remaining sums after step ``k`` of the columns after ``j``, and of the record with them."""
    p = reference.size
    pivot = max(left[k - 1, j, j] + lam, _LEAST)
    weight = (lam * reference[j] - left[k - 1, j, p]) / pivot if taken else reference[j]
    for a in range(j + 1, p):
        share[a] = left[k - 1, j, a] / pivot if taken else 0.0
        left[k, a, p] = left[k - 1, a, p] + weight * left[k - 1, j, a]
    shared = left[k - 1, j]
    for a in range(j + 1, p):
        before, after, part = left[k - 1, a], left[k, a], share[a]
        for b in range(a, p):
            after[b] = before[b] - part * shared[b]


@njit(**INNER)
def _penalised(
    gram: Array,
    lam: float,
    reference: Array,
    columns: Mask,
    index: Integers,
    work: Array,
    rhs: Array,
    back: Array,
) -> int:
    """Fill the normal equations of a set, about the reference; returns its size.

    What the reference has and the set lacks goes back into the record, by way of ``back``.
    """
    p = reference.size
    for j in range(back.size):
        back[j] = gram[p, j]
    for j in range(p):
        if not columns[j] and reference[j] != 0.0:
            for k in range(p):
                back[k] += reference[j] * gram[j, k]
    size = 0
    for j in range(p):
        if columns[j]:
            index[size] = j
            rhs[size] = back[j] - lam * reference[j]
            for b in range(size + 1):
                work[size, b] = gram[j, index[b]]
            work[size, size] += lam
            size += 1
    return size


@njit(**INNER)
def _without_shared(regression: _Regression, sets: Mask, rows: Indices, lam: float) -> tuple[Array, Indices]:
    """Sums without columns that all ``rows`` have, integrated out under their priors; and the columns left.

    Those whose coefficients have to be positive stay, and those that are others to rounding.
    """
    p = regression.reference.size
    left = regression.gram.copy()
    kept, size = np.empty(p + 1, np.int64), ZERO
    for j in range(p):
        shared = not regression.positive[j]
        for s in rows:
            if not sets[s, j]:
                shared = False
                break
        pivot = left[j, j] + lam
        if not shared or pivot <= 0.0:
            kept[size] = j
            size += 1
            continue
        left[j, p] -= lam * regression.reference[j]
        for a in range(p + 1):
            share = (left[j, p] if a == p else left[j, a]) / pivot
            if a != j and share != 0.0:
                for b in range(p + 1):
                    left[a, b] -= share * left[j, b]
    kept[size] = p
    some = np.empty((size + 1, size + 1))
    for a in range(size + 1):
        for b in range(size + 1):
            some[a, b] = left[kept[a], kept[b]]
    return some, kept[:size]


@njit(**KERNEL)
def _evaluate_sets(
    regression: _Regression, sets: Mask, rows: Indices, bounds: SetEvidences, best: float, log_weight: Array
) -> float:
    """Fill the log weights of some sets, ``rows`` in the order of falling bounds; returns the best.

    From bounds and the mass of positive coefficients.
    """
    bound, noise2, lam = bounds
    gram, kept = _without_shared(regression, sets, rows, lam)
    p = kept.size
    reference, positive, inside = np.empty(p), np.empty(p, np.bool_), np.empty(p, np.bool_)
    for a in range(p):
        reference[a], positive[a] = regression.reference[kept[a]], regression.positive[kept[a]]
    work, half, rhs, back = np.empty((p, p)), np.empty(p), np.empty(p), np.empty(p + 1)
    index, chosen = np.empty(p, np.int64), np.empty(p, np.int64)
    root, mean, cov = np.empty((p, p)), np.empty(p), np.empty((p, p))
    every, where, spread, room = (
        np.empty(p, np.int64),
        np.empty(p),
        np.empty(p),
        np.empty((2 * p + VECTORS, p)),
    )
    for a in range(p):
        every[a] = a
    # the mass is at most one: it is computed where it matters
    for s in rows:
        if bound[s] < best - _NEGLIGIBLE:
            break
        for a in range(p):
            inside[a] = sets[s, kept[a]]
        size = _penalised(gram, lam, reference, inside, index, work, rhs, back)
        factor(work, size)
        forward(work, rhs, size, half)
        some = ZERO
        for a in range(size):
            if positive[index[a]]:
                chosen[some] = a
                some += 1
        normal = _NormalEquations(work, half, index, size)
        _moments(normal, reference, chosen[:some], noise2[s], root, mean, cov)
        log_weight[s] = bound[s] + confine_all(some, mean, cov, every[:some], where, spread, room)
        best = max(best, log_weight[s])
    return best


@njit(**KERNEL)
def set_posterior(
    gram: Array, reference: Array, columns: Mask, lam: float, noise2: float
) -> tuple[Array, Array]:
    """Mean and covariance of a set's coefficients, before they are cut at zero.

    Parameters
    ----------
    gram : ndarray, shape (p + 1, p + 1)
        Sums as :func:`evaluate_sets` takes them.
    reference : ndarray, shape (p,)
    columns : ndarray of bool, shape (p,)
        The set.
    lam, noise2 : float
        Noise variance with all columns, in units of which the prior precision is one, and in the set.
    """
    p = reference.size
    work, half, rhs, back = np.empty((p, p)), np.empty(p), np.empty(p), np.empty(p + 1)
    index, every, root = np.empty(p, np.int64), np.empty(p, np.int64), np.empty((p, p))
    size = _penalised(gram, lam, reference, columns, index, work, rhs, back)
    factor(work, size)
    forward(work, rhs, size, half)
    for a in range(size):
        every[a] = a
    mean, cov = np.empty(size), np.empty((size, size))
    normal = _NormalEquations(work, half, index, size)
    _moments(normal, reference, every[:size], noise2, root, mean, cov)
    return mean, cov


@njit(**KERNEL)
def set_mean(
    gram: Array, reference: Array, columns: Mask, positive: Mask, lam: float, noise2: float
) -> Array:
    """Mean coefficients of a set, shape (p,), zero where it lacks one; parameters as above.

    Of those that have to be ``positive``, shape (p,), that of what lies above zero.
    """
    mean, cov = set_posterior(gram, reference, columns, lam, noise2)
    where, spread, law = np.empty(mean.size), np.empty(mean.size), np.zeros(reference.size)
    confine(mean, cov, positive[columns], where, spread)
    a = 0
    for j in range(reference.size):
        if columns[j]:
            law[j] = cut_moments(where[a], spread[a])[1] if positive[j] else where[a]
            a += 1
    return law


@njit(**INNER)
def _moments(
    normal: _NormalEquations,
    reference: Array,
    chosen: Integers,
    noise2: float,
    root: Array,
    mean: Array,
    cov: Array,
) -> None:
    """Fill mean and covariance of the ``chosen`` of a set's coefficients, by way of ``root``."""
    lower, half, index, size = normal
    for i in range(chosen.size):
        _inverse_column(lower, size, chosen[i], root[i])
        mean[i] = reference[index[chosen[i]]]
        for k in range(chosen[i], size):
            mean[i] += root[i, k] * half[k]
        for j in range(i + 1):
            total = 0.0
            for k in range(chosen[i], size):
                total += root[i, k] * root[j, k]
            cov[i, j] = cov[j, i] = total * noise2


@njit(**INNER)
def _inverse_column(lower: Array, size: int, a: int, column: Array) -> None:
    """Fill column ``a`` of the inverse of a triangular factor, from its diagonal on."""
    column[a] = 1.0 / lower[a, a]
    for b in range(a + 1, size):
        total = 0.0
        for k in range(a, b):
            total -= lower[b, k] * column[k]
        column[b] = total / lower[b, b]
