r"""Whitened sums between the points of a grid, for a sampler that needs them a hundred thousand times.

The sums change smoothly with ``l = log tau`` and ``u = log(q g(tau) / sigma)``, in which
:mod:`friction_bayes.statespace.force_grid` lays its grid. Cubic splines interpolate ``log det V`` and the
Cholesky factor of the Gram matrix, so that every misfit remains a sum of squares.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import NdBSpline, make_interp_spline

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.statespace.kalman import Whitened

__all__ = ["InterpolatedSums"]

_CUBIC = 3
_RIDGE = 1e-13
"""Over the diagonal: columns may be the same to rounding."""


@dataclass(frozen=True, eq=False)
class InterpolatedSums:
    """Sums of a whitened block of ``p`` columns on a rectangle of ``(u, l)``.

    Attributes
    ----------
    low, high : ndarray, shape (2,)
        Corners of the rectangle.
    columns : int
        ``p``.
    spline : NdBSpline
        Of the factor's upper triangle and the log determinant.
    """

    low: Array
    high: Array
    columns: int
    spline: NdBSpline

    @classmethod
    def over(cls, axes: tuple[Array, Array], sums: Callable[[float, float], Whitened]) -> InterpolatedSums:
        """Evaluate ``sums`` at every pair of the ascending ``axes``, in ``u`` and ``l``."""
        rows = []
        for u in axes[0]:
            for log_tau in axes[1]:
                found = sums(float(u), float(log_tau))
                gram = found.gram + _RIDGE * np.diag(np.diag(found.gram))
                factor = np.linalg.cholesky(gram).T
                rows.append(np.append(factor[_upper(len(gram))], found.log_determinant))
        p = len(gram)
        values = np.array(rows).reshape(axes[0].size, axes[1].size, -1)
        along_u = make_interp_spline(axes[0], values, k=_CUBIC)
        along_l = make_interp_spline(axes[1], np.moveaxis(along_u.c, 1, 0), k=_CUBIC)
        spline = NdBSpline((along_u.t, along_l.t), np.moveaxis(along_l.c, 0, 1), k=_CUBIC)
        low, high = (np.array([axis[end] for axis in axes]) for end in (0, -1))
        return cls(low, high, p, spline)

    def inside(self, places: Array) -> Mask:
        """Which places (u, l), shape (m, 2), lie in the rectangle, shape (m,)."""
        return np.asarray(np.all((places >= self.low) & (places <= self.high), axis=1))

    def at(self, places: Array) -> tuple[Array, Array]:
        """Upper factors, shape (m, p, p), and log determinants, shape (m,), at places inside."""
        values = self.spline(places)
        factors = np.zeros((len(places), self.columns, self.columns))
        factors[:, *_upper(self.columns)] = values[:, :-1]
        return factors, values[:, -1]


@cache
def _upper(size: int) -> tuple[Integers, Integers]:
    """Rows and columns of the upper triangle of a square matrix."""
    return np.triu_indices(size)
