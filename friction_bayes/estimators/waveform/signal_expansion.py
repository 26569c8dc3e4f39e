"""Squared residuals of a whole signal near an optimum, at a cost that does not grow with its length.

Around the optimum the signal is expanded to second order in its coefficients. The sum of squared residuals
is then a quadratic form in one vector, ``(1, -d, -d_i d_j)`` with ``d`` the distance from the optimum, whose
Gram matrix is taken over the samples once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array, Integers

__all__ = ["SignalExpansion", "agrees_near"]


_TOLERANCE = 0.02
"""Largest error of a log-likelihood where a posterior of five or six coefficients has its bulk."""

_BULK = 2.4
_RADIUS = 5.0
"""Standard deviations: where the bulk is, and as far as looked. Errors may grow as the fourth power."""
_PROBES = 64


@dataclass(frozen=True, eq=False)
class SignalExpansion:
    """Second-order expansion of a signal about an optimum, reduced to a Gram matrix.

    Attributes
    ----------
    centre : ndarray, shape (p,)
        The optimum.
    pairs : ndarray of int, shape (h, 2)
        Pairs of coefficients whose second derivatives were given.
    gram : ndarray, shape (1 + p + h, 1 + p + h)
        Inner products of residual, first and second derivatives over the samples.
    """

    centre: Array
    pairs: Integers
    gram: Array

    @classmethod
    def of(
        cls, centre: Array, residual: Array, jacobian: Array, curvature: Array, pairs: Integers
    ) -> SignalExpansion:
        """Reduce a residual (n,), first derivatives (n, p) and second derivatives (n, h)."""
        columns = np.column_stack([residual, jacobian, curvature])
        return cls(centre, pairs, columns.T @ columns)

    def misfit(self, coefficients: Array) -> Array:
        """Sum of squared residuals of coefficients, shape (m, p) to (m,)."""
        d = coefficients - self.centre
        first, second = self.pairs[:, 0], self.pairs[:, 1]
        products = d[:, first] * d[:, second] * np.where(first == second, 0.5, 1.0)
        vector = np.column_stack([np.ones(len(d)), -d, -products])
        return np.asarray(((vector @ self.gram) * vector).sum(axis=1), dtype=np.float64)


def agrees_near(
    approximate: Callable[[Array], Array],
    exact: Callable[[Array], Array],
    centre: Array,
    covariance: Array,
    variance: float,
) -> bool:
    """Whether two sums of squared residuals give one log-likelihood, within :data:`_TOLERANCE`.

    Parameters
    ----------
    approximate, exact : callable, (m, p) -> (m,)
        The two.
    centre, covariance : ndarray, shapes (p,) and (p, p)
        Where to look; the probes are fixed.
    variance : float
        Error variance at the centre.
    """
    rng = np.random.default_rng(_PROBES)
    directions = rng.standard_normal((_PROBES, centre.size))
    radius = _RADIUS * rng.random(_PROBES)
    directions *= (radius / np.linalg.norm(directions, axis=1))[:, None]
    scale = np.sqrt(np.diag(covariance))
    root = np.linalg.cholesky(covariance / np.outer(scale, scale)) * scale[:, None]
    probes = centre + directions @ root.T
    error = np.abs(approximate(probes) - exact(probes)) / (2.0 * variance)
    return bool(np.all(error <= _TOLERANCE * np.maximum(1.0, (radius / _BULK) ** 4)))
