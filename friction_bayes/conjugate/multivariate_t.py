"""A frozen multivariate Student t that is exact for coefficients of very different scales."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.linalg import solve_triangular
from scipy.special import gammaln

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError

__all__ = ["MultivariateT", "component_scales", "triangular_root"]

# scipy's stubs know this class without its keywords
_FROZEN: Any = stats.multivariate_t


@dataclass(frozen=True, eq=False)
class MultivariateT:
    """Multivariate t with the interface of a frozen ``scipy.stats.multivariate_t``.

    Kept as a triangular root of the inverse shape: scipy takes the eigenvalues of the shape matrix and
    refuses it, or drops directions, where variances differ by more than 5e9, as in a polynomial trend.

    Parameters
    ----------
    loc : ndarray, shape (p,)
        Location.
    root : ndarray, shape (p, p)
        Upper triangular ``U`` with ``inverse(shape) = U' U``.
    df : float
        Degrees of freedom.
    """

    loc: Array
    root: Array
    df: float

    @property
    def dim(self) -> int:
        """Number of components ``p``."""
        return self.loc.size

    @cached_property
    def _inverse_root(self) -> Array:
        return solve_triangular(self.root, np.eye(self.dim))

    @cached_property
    def shape(self) -> Array:
        """Shape matrix, (p, p)."""
        return self._inverse_root @ self._inverse_root.T

    def mean(self) -> Array:
        """Mean, shape (p,); nan where ``df <= 1`` leaves it undefined."""
        return self.loc.copy() if self.df > 1.0 else np.full(self.dim, np.nan)

    def cov(self) -> Array:
        """Covariance, shape (p, p); inf where ``df <= 2``."""
        if self.df <= 2.0:
            return np.full((self.dim, self.dim), np.inf)
        return self.shape * (self.df / (self.df - 2.0))

    def logpdf(self, x: ArrayLike) -> Array:
        """Log-density at points of shape (..., p)."""
        z = (np.asarray(x, dtype=np.float64) - self.loc) @ self.root.T
        return self._log_constant - 0.5 * (self.df + self.dim) * np.log1p((z**2).sum(axis=-1) / self.df)

    def pdf(self, x: ArrayLike) -> Array:
        """Density at points of shape (..., p)."""
        return np.exp(self.logpdf(x))

    def cdf(self, x: ArrayLike, *, random_state: np.random.Generator) -> Any:
        """Probability of lying below ``x`` in every component, by scipy's quasi-Monte Carlo."""
        scale = np.sqrt(np.diag(self.shape))
        correlation = self.shape / np.outer(scale, scale)
        standard = _FROZEN(shape=correlation, df=self.df, allow_singular=True)
        return standard.cdf((np.asarray(x, dtype=np.float64) - self.loc) / scale, random_state=random_state)

    def entropy(self) -> float:
        """Differential entropy."""
        standard = float(_FROZEN(shape=np.eye(self.dim), df=self.df).entropy())
        return standard - self._log_root

    def rvs(
        self, size: int | tuple[int, ...] = 1, random_state: np.random.Generator | int | None = None
    ) -> Array:
        """Draws of shape (size, p), or ``size + (p,)`` for a tuple; a generator or a seed must be given."""
        if random_state is None:
            raise TypeError("rvs needs random_state: give a numpy Generator or a seed")
        rng = np.random.default_rng(random_state)
        sizes = (size,) if isinstance(size, int) else tuple(size)
        z = rng.standard_normal((*sizes, self.dim)) @ self._inverse_root.T
        return self.loc + z * np.sqrt(self.df / rng.chisquare(self.df, sizes))[..., None]

    def linear(self, weights: ArrayLike) -> Any:
        """Frozen univariate t of the linear combination ``weights @ x``."""
        c = np.asarray(weights, dtype=np.float64)
        return stats.t(
            df=self.df, loc=float(c @ self.loc), scale=float(np.linalg.norm(c @ self._inverse_root))
        )

    @cached_property
    def _log_root(self) -> float:
        return float(np.log(np.abs(np.diag(self.root))).sum())

    @cached_property
    def _log_constant(self) -> float:
        p = self.dim
        halves = float(gammaln(0.5 * (self.df + p)) - gammaln(0.5 * self.df))
        return halves - 0.5 * p * math.log(self.df * math.pi) + self._log_root


def component_scales(root: Array) -> Array:
    """Scales of the components' Student t of many distributions: roots (records, p, p) to (records, p)."""
    inverse = np.linalg.solve(root, np.broadcast_to(np.eye(root.shape[-1]), root.shape))
    return np.sqrt((inverse**2).sum(axis=-1))


def triangular_root(precision: Array, size: int) -> Array:
    """Return an upper triangular root of a scalar, diagonal or matrix precision."""
    if precision.ndim < 2:
        if precision.shape not in ((), (1,), (size,)):
            raise InputError(
                "precision", f"has shape {precision.shape}", f"give 1, {size} or {size} x {size} numbers"
            )
        if np.any(precision < 0.0):
            raise InputError(
                "precision", f"{precision.min():g} is negative", "give zero or a positive number"
            )
        return np.diag(np.broadcast_to(np.sqrt(precision), size))
    if precision.shape != (size, size) or not np.allclose(precision, precision.T, rtol=1e-10, atol=0.0):
        raise InputError(
            "precision",
            f"of shape {precision.shape} is not symmetric",
            f"give a symmetric {size} x {size} matrix",
        )
    scale = np.sqrt(np.abs(np.diag(precision)))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    if values[0] < -1e-12 * size:
        raise InputError("precision", "has a negative eigenvalue", "give a positive semidefinite matrix")
    return np.linalg.qr(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)[1] * scale
