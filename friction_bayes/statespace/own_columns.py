r"""Coefficients that are each record's own, integrated out of the sums of several records.

With the sums ``G`` of ``[O S y]`` and a normal prior of the own coefficients ``O``, of precision ``lam`` in
units of the noise as in :mod:`friction_bayes.statespace.subset_evidence`, the likelihood of the shared ones
has the sums

.. math:: G_{SS} - G_{SO}\,(G_{OO}+\lambda I)^{-1} G_{OS}

and :math:`\tfrac12\log|G_{OO}+\lambda I| - \tfrac{|O|}{2}\log\lambda` is subtracted from its log evidence.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Integers
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.statespace.cholesky import factor
from friction_bayes.statespace.regression import RIDGE

__all__ = ["Eliminated", "OwnColumns", "eliminate"]


class OwnColumns(NamedTuple):
    """Which columns are integrated out, and which are left.

    Attributes
    ----------
    columns : ndarray of int, shape (k + s,)
        Those of a record that are its own, then those that are shared.
    scale : ndarray, shape (k + s,)
        Factors on these: of a deviation between the records the sd of that, and one otherwise.
    centre : ndarray, shape (r, k)
        Reference of the own coefficients, whose prior mean is zero.
    back : ndarray, shape (r, p)
        Coefficients of what the reference has and goes back into each record.
    """

    columns: Integers
    scale: Array
    centre: Array
    back: Array


class Eliminated(NamedTuple):
    """Sums without the records' own columns, and factors to recover these.

    ``root`` (r, k, k) is the Cholesky factor of each record's own block, ``cross`` (r, k, s + 1) its inverse
    times the sums of own columns with the shared ones and the record.
    """

    gram: Array
    log_determinant: float
    root: Array
    cross: Array

    def own(self, shared: Array, score: Array | None = None) -> Array:
        """Own coefficients, shape (r, n, k), given shared ones, shape (n, s), both less their reference.

        With normal scores, shape (r, n, k), draws for a noise of unit variance instead of means.
        """
        right = self.cross[:, :, -1][:, :, None] - self.cross[:, :, :-1] @ shared.T
        if score is not None:
            right = right + score.transpose(0, 2, 1)
        return np.asarray(np.linalg.solve(self.root.transpose(0, 2, 1), right).transpose(0, 2, 1))


def eliminate(grams: Array, own: OwnColumns, lam: float) -> Eliminated:
    """Integrate the own columns out of the sums of the records; for ``lam`` zero, by least squares.

    Parameters
    ----------
    grams : ndarray, shape (r, p + 1, p + 1)
    own : OwnColumns
    lam : float
        Precision of the prior of the own coefficients.
    """
    prior = own.centre.size * math.log(lam) if lam > 0.0 else 0.0
    gram, log_determinant, root, cross = _eliminate(grams, *own, lam)
    return Eliminated(gram, log_determinant - prior, root, cross)


@njit(**KERNEL)
def _eliminate(
    grams: Array, columns: Integers, scale: Array, centre: Array, back: Array, lam: float
) -> tuple[Array, float, Array, Array]:
    records, last = grams.shape[0], grams.shape[1] - 1
    size, k = columns.size, centre.shape[1]
    left = size + 1 - k
    sums = np.empty((size + 1, size + 1))
    gram = np.zeros((left, left))
    root, cross = np.zeros((records, k, k)), np.empty((records, k, left))
    returned = np.empty(last, np.int64)
    log_determinant = 0.0
    for r in range(records):
        g, own = grams[r], cross[r]
        count = 0
        for a in range(last):
            if back[r, a] != 0.0:
                returned[count] = a
                count += 1
        sums[size, size] = g[last, last]
        for a in returned[:count]:
            sums[size, size] += 2.0 * back[r, a] * g[a, last]
            for b in returned[:count]:
                sums[size, size] += back[r, a] * back[r, b] * g[a, b]
        for i in range(size):
            a = columns[i]
            with_record = g[a, last]
            for b in returned[:count]:
                with_record += back[r, b] * g[a, b]
            sums[i, size] = sums[size, i] = scale[i] * with_record
            for j in range(size):
                sums[i, j] = scale[i] * scale[j] * g[a, columns[j]]
        for i in range(k):
            sums[i, size] -= lam * centre[r, i]
            sums[size, size] += lam * centre[r, i] * centre[r, i]
            for j in range(i + 1):
                root[r, i, j] = sums[i, j]
            root[r, i, i] += lam if lam > 0.0 else RIDGE * sums[i, i] + 1e-300
        factor(root[r], k)
        for i in range(left):
            for j in range(left):
                gram[i, j] += sums[k + i, k + j]
        for i in range(k):
            log_determinant += 2.0 * math.log(root[r, i, i])
            for j in range(left):
                own[i, j] = sums[i, k + j]
            for before in range(i):
                share = root[r, i, before]
                for j in range(left):
                    own[i, j] -= share * own[before, j]
            for j in range(left):
                own[i, j] /= root[r, i, i]
            for a in range(left):
                for b in range(left):
                    gram[a, b] -= own[i, a] * own[i, b]
    return gram, log_determinant, root, cross
