"""Sufficient statistics: all that a likelihood needs of its samples, or of a design and its response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array
from friction_bayes.core.errors import InputError

__all__ = ["NormalStatistics", "RegressionStatistics", "solve_each", "squared_lengths"]


@dataclass(frozen=True)
class NormalStatistics:
    """Sufficient statistics of a normal sample: count, mean and centred sum of squares.

    Attributes
    ----------
    n : int
        Number of samples.
    mean : float
        Their mean; 0 for an empty sample.
    sum_of_squares : float
        ``sum((x - mean)**2)``.
    """

    n: int
    mean: float
    sum_of_squares: float

    @classmethod
    def of(cls, samples: ArrayLike, *, place: str = "samples") -> NormalStatistics:
        """Reduce samples of any shape; refuses what is not finite.

        The sums are taken about the first sample and then about the mean, so that an offset far larger
        than the scatter costs no digits.
        """
        x = finite_array(place, samples).ravel()
        if x.size == 0:
            return cls(0, 0.0, 0.0)
        shifted = x - x[0]
        shift_mean = float(shifted.mean())
        centred = shifted - shift_mean
        # what rounding left of the mean of the centred samples is taken out of the squares
        squares = float(centred @ centred) - float(centred.sum()) ** 2 / x.size
        return cls(x.size, float(x[0]) + shift_mean, max(squares, 0.0))


@dataclass(frozen=True, eq=False)
class RegressionStatistics:
    """Sufficient statistics of a Gaussian linear regression in QR form, ``design = Q R``.

    Those of many records have a leading axis of records in every field.

    Attributes
    ----------
    n : int, or ndarray of shape (records,)
        Number of responses.
    r : ndarray, shape (..., min(n, p), p)
        Triangular factor ``R``.
    projected : ndarray, shape (..., min(n, p))
        ``Q' y``.
    residual_sum : float, or ndarray of shape (records,)
        Residual sum of squares of ordinary least squares, ``|y - Q Q' y|**2``.
    """

    n: Any
    r: Array
    projected: Array
    residual_sum: Any

    @classmethod
    def of(cls, design: ArrayLike, response: ArrayLike) -> RegressionStatistics:
        """Reduce a design of shape (n, p) and a response of shape (n,).

        Raises
        ------
        InputError
            If the shapes do not belong together or a value is not finite.
        """
        x, y = finite_array("design", design), finite_array("response", response)
        if x.ndim != 2:
            raise InputError("design", f"has shape {x.shape}", "give a matrix of n rows and p columns")
        if y.shape != (x.shape[0],):
            raise InputError(
                "response", f"has shape {y.shape}", f"give {x.shape[0]} values, one per row of design"
            )
        q, r = np.linalg.qr(x)
        projected = q.T @ y
        residual = y - q @ projected
        return cls(y.size, r, projected, float(residual @ residual))

    @classmethod
    def of_normal_equations(
        cls, n: ArrayLike, normal: Array, gradient: Array, coefficients: Array, misfit: ArrayLike
    ) -> RegressionStatistics:
        """Reduce many records from their normal equations at any coefficients, optimal or not.

        Parameters
        ----------
        n : array_like of int, shape (records,)
            Numbers of responses.
        normal : ndarray, shape (records, p, p)
            ``X'X``, positive definite.
        gradient, coefficients : ndarray, shape (records, p)
            ``X'(y - X b)`` and ``b``.
        misfit : array_like, shape (records,)
            ``|y - X b|**2``.
        """
        lower = np.asarray(np.linalg.cholesky(normal), dtype=np.float64)
        r = lower.swapaxes(-1, -2)
        step = solve_each(lower, gradient, lower=True)
        projected = np.matmul(r, coefficients[..., None])[..., 0] + step
        residual = np.asarray(misfit) - squared_lengths(step)
        return cls(np.asarray(n), r, projected, np.maximum(residual, 0.0))

    def as_batch(self) -> RegressionStatistics:
        """Return the same with a leading axis of one record."""
        return RegressionStatistics(
            np.array([self.n]), self.r[None], self.projected[None], np.array([self.residual_sum])
        )

    def record(self, index: int) -> RegressionStatistics:
        """Return those of one record of many."""
        return RegressionStatistics(
            int(self.n[index]), self.r[index], self.projected[index], float(self.residual_sum[index])
        )


def solve_each(triangular: Array, right: Array, *, lower: bool = False) -> Array:
    """Solve a triangular system for every record.

    Parameters
    ----------
    triangular : ndarray, shape (records, p, p)
        Upper triangular matrices, or lower ones.
    right : ndarray, shape (records, p)
        Right-hand sides.
    lower : bool
        Which of the two.
    """
    size = right.shape[1]
    solution = np.empty(right.shape)
    for i in range(size) if lower else reversed(range(size)):
        known = slice(i) if lower else slice(i + 1, size)
        explained = np.sum(triangular[:, i, known] * solution[:, known], axis=1)
        solution[:, i] = (right[:, i] - explained) / triangular[:, i, i]
    return solution


def squared_lengths(vectors: Array) -> Array:
    """Squared length of every vector, shape (records, n) to (records,)."""
    return np.matmul(vectors[:, None, :], vectors[:, :, None])[:, 0, 0]
