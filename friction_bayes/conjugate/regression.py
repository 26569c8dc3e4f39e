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

from friction_bayes.conjugate.multivariate_t import MultivariateT, component_scales, triangular_root
from friction_bayes.conjugate.sufficient_statistics import (
    RegressionStatistics,
    solve_each,
    squared_lengths,
)
from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.checks import finite, finite_array, non_negative
from friction_bayes.core.errors import InputError

__all__ = ["CoefficientMarginals", "NormalInverseGamma", "mean_error_sd"]


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
        root = triangular_root(finite_array("precision", precision), centre.size)
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
        _require_full_rank(np.vstack([self.factor, data.r]))
        (mean,), (factor,), (alpha,), (beta,) = self.parameters_after(data.as_batch())
        return NormalInverseGamma(mean, factor, float(alpha), float(beta))

    def parameters_after(self, data: RegressionStatistics) -> tuple[Array, Array, Array, Array]:
        """Return ``mean``, ``factor``, ``alpha`` and ``beta`` after the data of many records, each by itself.

        They have a leading axis of records. Design and prior together must determine all coefficients.
        """
        records, p = len(data.r), self.size
        stacked = np.concatenate([np.broadcast_to(self.factor, (records, p, p)), data.r], axis=1)
        misfit = np.concatenate([np.zeros((records, p)), data.projected - data.r @ self.mean], axis=1)
        scale = np.linalg.norm(stacked, axis=1)
        scaled = stacked / scale[:, None, :]
        q, r = np.linalg.qr(scaled)
        solution = solve_each(r, np.matmul(q.swapaxes(-1, -2), misfit[..., None])[..., 0])
        residual = misfit - np.matmul(scaled, solution[..., None])[..., 0]
        beta = self.beta + 0.5 * (data.residual_sum + squared_lengths(residual))
        return self.mean + solution / scale, r * scale[:, None, :], self.alpha + 0.5 * data.n, beta

    @property
    def coefficients(self) -> MultivariateT:
        """Marginal of the coefficients: frozen multivariate t with ``2 alpha`` degrees of freedom."""
        self._require_proper("marginal of the coefficients")
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
        self._require_proper("marginal of the variance")
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
        self._require_proper("density")
        constant = self.alpha * math.log(self.beta) - float(gammaln(self.alpha)) + self._log_factor
        return self.log_kernel(coefficients, variance) + (
            constant - 0.5 * self.size * math.log(2.0 * math.pi)
        )

    def log_evidence(self, design: ArrayLike, response: ArrayLike) -> float:
        """Log marginal likelihood of the response under this prior; proper priors only."""
        self._require_proper("evidence")
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
        self._require_proper("predictive distribution")
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
                f"{np.linalg.matrix_rank(self.factor)} of {self.size} is improper and has no {what}",
                "update it with more data than coefficients, or give a proper prior",
            )


@dataclass(frozen=True, eq=False)
class CoefficientMarginals:
    """Student t marginals of the coefficients of many posteriors; nan where there is none.

    Attributes
    ----------
    mean, scale : ndarray, shape (records, p)
        Location and scale of the coefficients.
    degrees : ndarray, shape (records,)
        Degrees of freedom.
    noise_sd : ndarray, shape (records,)
        Posterior mean standard deviation of an error.
    """

    mean: Array
    scale: Array
    degrees: Array
    noise_sd: Array

    @classmethod
    def of(cls, prior: NormalInverseGamma, data: RegressionStatistics, found: Mask) -> CoefficientMarginals:
        """After the data of many records; where not ``found`` they may be anything of full rank."""
        mean, factor, alpha, beta = prior.parameters_after(data)
        usable = found & (alpha > 0.5) & (beta > 0.0)
        alpha, beta = np.where(usable, alpha, np.nan), np.where(usable, beta, np.nan)
        scale = component_scales(factor * np.sqrt(alpha / beta)[:, None, None])
        return cls(np.where(usable[:, None], mean, np.nan), scale, 2.0 * alpha, mean_error_sd(alpha, beta))


def mean_error_sd(alpha: Any, beta: Any) -> Any:
    """Mean of the error's standard deviation when its variance is inverse gamma; arrays broadcast."""
    return np.sqrt(beta) * np.exp(gammaln(alpha - 0.5) - gammaln(alpha))


def _require_full_rank(stacked: Array) -> None:
    """Refuse a design whose columns, scaled to length one, are linearly dependent to rounding."""
    length = np.linalg.norm(stacked, axis=0)
    _, r, order = qr(stacked / np.where(length > 0.0, length, 1.0), mode="economic", pivoting=True)
    size = np.abs(np.diag(r))
    rank = int(np.count_nonzero(size > max(stacked.shape) * np.finfo(float).eps * max(size[0], 1.0)))
    if rank < stacked.shape[1]:
        columns = ", ".join(str(i) for i in sorted(order[rank:]))
        raise InputError(
            "design",
            f"rank {rank} with {stacked.shape[1]} columns: column {columns} depends linearly on the others",
            "leave it out, add data, or give the coefficients a prior precision above zero",
        )
