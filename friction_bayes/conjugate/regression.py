"""The normal-inverse-gamma pair: linear regression with normal errors of unknown variance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.linalg import qr, solve_triangular
from scipy.special import gammaln

from friction_bayes.conjugate.likelihood import RegressionStatistics
from friction_bayes.conjugate.multivariate_t import MultivariateT
from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, finite_array, non_negative
from friction_bayes.core.errors import InputError

__all__ = ["NormalInverseGamma", "mean_error_sd"]


@dataclass(frozen=True, eq=False)
class NormalInverseGamma:
    """Joint distribution of regression coefficients ``b`` and error variance ``v``.

    ``v`` is inverse gamma with shape ``alpha`` and scale ``beta``; given ``v``, ``b`` is normal with mean
    ``mean`` and covariance ``v inverse(F'F)``. Build a prior with :meth:`from_prior`.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        Mean of the coefficients.
    factor : ndarray, shape (p, p)
        Upper triangular root ``F`` of the coefficients' precision in units of ``1/v``.
    alpha : float
        Shape of the variance.
    beta : float
        Scale of the variance [unit of the response squared].

    Notes
    -----
    The posterior after a design ``X`` and a response ``y`` is the least-squares problem in which the rows
    of ``F`` are stacked on those of ``X``: its triangular factor is the new ``F``, its solution the new mean,
    and half its residual sum of squares is added to ``beta``, never a difference of large sums.
    """

    mean: Array
    factor: Array
    alpha: float
    beta: float

    @classmethod
    def from_prior(
        cls, *, mean: ArrayLike, precision: ArrayLike, alpha: float, beta: float
    ) -> NormalInverseGamma:
        """Build a prior.

        Parameters
        ----------
        mean : array_like, shape (p,)
            Prior mean of the coefficients.
        precision : array_like, scalar, shape (p,) or (p, p)
            Precision of the coefficients relative to that of an error: one for all, a diagonal, or a positive
            semidefinite matrix. Zero is flat.
        alpha : float
            Shape of the variance; half the number of responses the prior is worth. With ``beta = 0`` any
            ``alpha <= 0`` is a flat prior: ``-p/2`` gives density proportional to ``1/v``.
        beta : float
            Scale of the variance, >= 0.

        Raises
        ------
        InputError
            If shapes do not belong together, a value is not finite, or a precision is negative.
        """
        centre = np.atleast_1d(finite_array("mean", mean))
        if centre.ndim != 1:
            raise InputError("mean", f"has shape {centre.shape}", "give one number per coefficient")
        root = _root(finite_array("precision", precision), centre.size)
        return cls(centre, root, finite("alpha", alpha), non_negative("beta", beta))

    @property
    def size(self) -> int:
        """Number of coefficients ``p``."""
        return self.mean.size

    @property
    def proper(self) -> bool:
        """Whether the density integrates to one."""
        return self.alpha > 0.0 and self.beta > 0.0 and bool(np.all(np.diag(self.factor) != 0.0))

    @property
    def precision(self) -> Array:
        """Precision of the coefficients relative to that of an error, ``F'F``, shape (p, p)."""
        return self.factor.T @ self.factor

    def update(self, design: ArrayLike, response: ArrayLike) -> NormalInverseGamma:
        """Return the posterior after a design of shape (n, p) and a response of shape (n,).

        Raises
        ------
        InputError
            If shapes do not belong together, a value is not finite, or design and prior together leave a
            combination of coefficients undetermined.
        """
        return self.update_statistics(RegressionStatistics.of(design, response))

    def update_statistics(self, data: RegressionStatistics) -> NormalInverseGamma:
        """Return the posterior after data already reduced to ``R``, ``Q'y``, residual sum and count."""
        if data.r.shape[1] != self.size:
            raise InputError(
                "design",
                f"has {data.r.shape[1]} columns",
                f"give {self.size}, one per coefficient of the prior",
            )
        if data.n == 0:
            return self
        stacked = np.vstack([self.factor, data.r])
        misfit = np.concatenate([np.zeros(self.size), data.projected - data.r @ self.mean])
        scale = np.linalg.norm(stacked, axis=0)
        scaled = stacked / np.where(scale > 0.0, scale, 1.0)
        _require_full_rank(scaled)
        q, r = np.linalg.qr(scaled)
        solution = solve_triangular(r, q.T @ misfit)
        residual = misfit - scaled @ solution
        return NormalInverseGamma(
            self.mean + solution / scale,
            r * scale,
            self.alpha + 0.5 * data.n,
            self.beta + 0.5 * (data.residual_sum + float(residual @ residual)),
        )

    @property
    def coefficients(self) -> MultivariateT:
        """Marginal of the coefficients: frozen multivariate t with ``2 alpha`` degrees of freedom."""
        self._require_proper("a marginal of the coefficients")
        return MultivariateT(self.mean, self.factor * math.sqrt(self.alpha / self.beta), 2.0 * self.alpha)

    def linear(self, weights: ArrayLike) -> Any:
        """Frozen Student t of the combination ``weights @ b``, weights of shape (p,)."""
        c = finite_array("weights", weights)
        if c.shape != (self.size,):
            raise InputError(
                "weights", f"has shape {c.shape}", f"give {self.size} weights, one per coefficient"
            )
        return self.coefficients.linear(c)

    def marginal(self, index: int) -> Any:
        """Frozen Student t of one coefficient."""
        return self.linear(np.eye(self.size)[index])

    @property
    def variance(self) -> Any:
        """Marginal of the error variance: frozen inverse gamma."""
        self._require_proper("a marginal of the variance")
        return stats.invgamma(self.alpha, scale=self.beta)

    def log_kernel(self, coefficients: ArrayLike, variance: ArrayLike) -> Array:
        """Joint log-density without its constant, which an improper prior does not have."""
        v = np.asarray(variance, dtype=np.float64)
        inside = v > 0.0
        v = np.where(inside, v, 1.0)
        z = (np.asarray(coefficients, dtype=np.float64) - self.mean) @ self.factor.T
        power = 0.5 * self.size + self.alpha + 1.0
        value = -power * np.log(v) - (self.beta + 0.5 * (z**2).sum(axis=-1)) / v
        return np.where(inside, value, -np.inf)

    def logpdf(self, coefficients: ArrayLike, variance: ArrayLike) -> Array:
        """Joint log-density of coefficients, shape (..., p), and variance, shape (...)."""
        self._require_proper("a density")
        constant = self.alpha * math.log(self.beta) - float(gammaln(self.alpha)) + self._log_factor
        return self.log_kernel(coefficients, variance) + (
            constant - 0.5 * self.size * math.log(2.0 * math.pi)
        )

    def log_evidence(self, design: ArrayLike, response: ArrayLike) -> float:
        """Log marginal likelihood of the response under this prior; proper priors only."""
        self._require_proper("an evidence")
        data = RegressionStatistics.of(design, response)
        after = self.update_statistics(data)
        return float(
            gammaln(after.alpha)
            - gammaln(self.alpha)
            + self.alpha * math.log(self.beta)
            - after.alpha * math.log(after.beta)
            + self._log_factor
            - after._log_factor
            - 0.5 * data.n * math.log(2.0 * math.pi)
        )

    def predictive(self, design: ArrayLike) -> MultivariateT:
        """Posterior predictive of the responses to a design of shape (n, p): frozen multivariate t.

        It holds an (n, n) matrix: give the rows of interest, not a whole record.
        """
        self._require_proper("a predictive distribution")
        x = np.atleast_2d(finite_array("design", design))
        if x.shape[1] != self.size:
            raise InputError("design", f"has {x.shape[1]} columns", f"give {self.size}, one per coefficient")
        # a root of I + X inverse(F'F) X' as the triangular factor of a stack
        spread = np.vstack([np.eye(x.shape[0]), solve_triangular(self.factor, x.T, trans="T")])
        lower = np.linalg.qr(spread)[1].T
        inverse = solve_triangular(lower, np.eye(x.shape[0]), lower=True)
        root = np.linalg.qr(inverse)[1] * math.sqrt(self.alpha / self.beta)
        return MultivariateT(x @ self.mean, root, 2.0 * self.alpha)

    def rvs(self, size: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Draw coefficients, shape (size, p), and variances, shape (size,)."""
        self._require_proper("draws")
        variance = self.beta / rng.gamma(self.alpha, 1.0, size)
        z = rng.standard_normal((size, self.size)) * np.sqrt(variance)[:, None]
        return self.mean + solve_triangular(self.factor, z.T).T, variance

    @property
    def _log_factor(self) -> float:
        return float(np.log(np.abs(np.diag(self.factor))).sum())

    def _require_proper(self, what: str) -> None:
        if not self.proper:
            raise InputError(
                "NormalInverseGamma",
                f"alpha={self.alpha:g}, beta={self.beta:g}, precision of rank "
                f"{np.linalg.matrix_rank(self.factor)} of {self.size} is improper and has not {what}",
                "update it with more data than coefficients, or give a proper prior",
            )


def mean_error_sd(alpha: Any, beta: Any) -> Any:
    """Mean of the error's standard deviation when its variance is inverse gamma; arrays broadcast."""
    return np.sqrt(beta) * np.exp(gammaln(alpha - 0.5) - gammaln(alpha))


def _root(precision: Array, size: int) -> Array:
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


def _require_full_rank(scaled: Array) -> None:
    """Refuse a design whose columns, scaled to length one, are linearly dependent to rounding."""
    _, r, order = qr(scaled, mode="economic", pivoting=True)
    size = np.abs(np.diag(r))
    rank = int(np.count_nonzero(size > max(scaled.shape) * np.finfo(float).eps * max(size[0], 1.0)))
    if rank < scaled.shape[1]:
        columns = ", ".join(str(i) for i in sorted(order[rank:]))
        raise InputError(
            "design",
            f"rank {rank} with {scaled.shape[1]} columns: column {columns} depends linearly on the others",
            "leave it out, add data, or give the coefficients a prior precision above zero",
        )
