"""The normal-gamma pair, Eqs. (4)-(8) of the paper: normal samples of unknown mean and precision."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import gammaln, xlogy

from friction_bayes.conjugate.credible import IntervalKind, credible_interval, normal_gamma_level
from friction_bayes.conjugate.sufficient_statistics import NormalStatistics
from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite, non_negative, positive
from friction_bayes.core.errors import InputError

__all__ = ["NormalGamma"]


@dataclass(frozen=True)
class NormalGamma:
    """Joint distribution of the friction force ``r`` and the precision ``s`` of a sample of it, Eq. (4).

    ``s`` is gamma with shape ``alpha`` and rate ``beta``; given ``s``, ``r`` is normal with mean ``mu`` and
    precision ``lam s``. Prior and posterior alike.

    Parameters
    ----------
    mu : float
        Mean of ``r`` [unit of the samples].
    lam : float
        How many samples' worth ``mu`` is, >= 0.
    alpha : float
        Shape of the precision.
    beta : float
        Rate of the precision [unit of the samples squared], >= 0.

    Raises
    ------
    InputError
        If a parameter is not finite, or ``lam`` or ``beta`` is negative.

    Notes
    -----
    ``lam``, ``alpha`` or ``beta`` at or below zero make an improper (flat) prior: it can be updated, but it
    has no marginals, no evidence and no draws. ``NormalGamma(0, 0, -0.5, 0)`` is the usual one, with density
    proportional to ``1/s``.

    Examples
    --------
    >>> prior = NormalGamma(mu=0.1, lam=1.0, alpha=1.0, beta=0.02)
    >>> posterior = prior.update([0.06, 0.08])
    >>> round(posterior.mu, 10), posterior.lam, posterior.alpha, round(posterior.beta, 10)
    (0.08, 3.0, 2.0, 0.0204)
    """

    mu: float
    lam: float
    alpha: float
    beta: float

    def __post_init__(self) -> None:
        checks = {"mu": finite, "lam": non_negative, "alpha": finite, "beta": non_negative}
        for name, check in checks.items():
            object.__setattr__(self, name, check(name, getattr(self, name)))

    @property
    def proper(self) -> bool:
        """Whether the density integrates to one."""
        return self.lam > 0.0 and self.alpha > 0.0 and self.beta > 0.0

    def update(self, samples: ArrayLike) -> NormalGamma:
        """Return the posterior after friction samples of any shape, Eqs. (5)-(8)."""
        return self._after(NormalStatistics.of(samples))

    def update_statistics(self, n: int, mean: float, ss: float) -> NormalGamma:
        """Return the posterior after ``n`` samples of the given mean and centred sum of squares."""
        count = non_negative("n", n)
        if count != int(count):
            raise InputError("n", f"{n} is not a whole number", "give the number of samples")
        return self._after(NormalStatistics(int(count), finite("mean", mean), non_negative("ss", ss)))

    def _after(self, data: NormalStatistics) -> NormalGamma:
        if data.n == 0:
            return self
        return NormalGamma(*self.parameters_after(data.n, data.mean, data.sum_of_squares))

    def parameters_after(self, n: Any, mean: Any, sum_of_squares: Any) -> tuple[Any, Any, Any, Any]:
        """Return ``mu``, ``lam``, ``alpha`` and ``beta`` after samples, Eqs. (5)-(8); arrays broadcast.

        Parameters
        ----------
        n, mean, sum_of_squares : float or ndarray
            Number of samples (at least one), their mean, and their centred sum of squares.
        """
        lam = self.lam + n
        step = mean - self.mu
        # the centred form of Eq. (8): differences are squared, squares never subtracted
        beta = self.beta + 0.5 * sum_of_squares + 0.5 * self.lam * n / lam * step**2
        return self.mu + n / lam * step, lam, self.alpha + 0.5 * n, beta

    @property
    def friction(self) -> Any:
        """Marginal of ``r``: frozen Student t with ``2 alpha`` degrees of freedom."""
        self._require_proper("friction marginal")
        scale = math.sqrt(self.beta / self.alpha / self.lam)
        return stats.t(df=2.0 * self.alpha, loc=self.mu, scale=scale)

    @property
    def precision(self) -> Any:
        """Marginal of ``s``: frozen gamma with mean ``alpha/beta`` and variance ``alpha/beta**2``."""
        self._require_proper("precision marginal")
        return stats.gamma(self.alpha, scale=1.0 / self.beta)

    def log_kernel(self, r: ArrayLike, s: ArrayLike) -> Array:
        """Eq. (4) without its constant, which an improper prior does not have."""
        r, s = np.asarray(r, dtype=np.float64), np.asarray(s, dtype=np.float64)
        inside = s > 0.0
        s = np.where(inside, s, 1.0)
        value = xlogy(self.alpha - 0.5, s) - s * (self.beta + 0.5 * self.lam * (r - self.mu) ** 2)
        return np.where(inside, value, -np.inf)

    def logpdf(self, r: ArrayLike, s: ArrayLike) -> Array:
        """Joint log-density of ``r`` and ``s``, Eq. (4); arguments broadcast."""
        self._require_proper("density")
        constant = self.alpha * math.log(self.beta) + 0.5 * math.log(self.lam / (2.0 * math.pi))
        return self.log_kernel(r, s) + (constant - float(gammaln(self.alpha)))

    def friction_interval(self, p: float = 0.9) -> tuple[float, float]:
        """Credible interval of ``r``; the marginal is symmetric, so both kinds of interval are this one."""
        return credible_interval(self.friction, p)

    def precision_interval(self, p: float = 0.9, kind: IntervalKind = "equal-tailed") -> tuple[float, float]:
        """Credible interval of ``s``, equal-tailed or highest-density (the shortest)."""
        return credible_interval(self.precision, p, kind)

    def credible_level(self, p: float = 0.9) -> float:
        """Return the level of :meth:`logpdf` above which the joint credible region of mass ``p`` lies.

        The region is ``logpdf(r, s) >= credible_level(p)``: draw its border as a contour, or test whether a
        point is a member. Its mass is ``p`` to 1e-8 (see
        :func:`~friction_bayes.conjugate.credible.normal_gamma_level`).
        """
        self._require_proper("credible region")
        return normal_gamma_level(self.alpha, p) + 0.5 * (math.log(self.lam) + math.log(self.beta))

    def predictive(self, n: int = 1) -> Any:
        """Posterior predictive of the mean of ``n`` further samples, frozen Student t; of one by default."""
        self._require_proper("predictive distribution")
        spread = self.beta / self.alpha * (1.0 / positive("n", n) + 1.0 / self.lam)
        return stats.t(df=2.0 * self.alpha, loc=self.mu, scale=math.sqrt(spread))

    def log_evidence(self, samples: ArrayLike) -> float:
        """Log marginal likelihood of samples of any shape under this prior; proper priors only."""
        self._require_proper("evidence")
        data = NormalStatistics.of(samples)
        after = self._after(data)
        return float(
            gammaln(after.alpha)
            - gammaln(self.alpha)
            + self.alpha * math.log(self.beta)
            - after.alpha * math.log(after.beta)
            + 0.5 * (math.log(self.lam) - math.log(after.lam))
            - 0.5 * data.n * math.log(2.0 * math.pi)
        )

    def rvs(self, size: int | tuple[int, ...], rng: np.random.Generator) -> tuple[Array, Array]:
        """Draw ``(r, s)``, each of shape ``size``."""
        self._require_proper("draws")
        s = rng.gamma(self.alpha, 1.0 / self.beta, size)
        return rng.normal(self.mu, 1.0 / np.sqrt(self.lam * s)), s

    def _require_proper(self, what: str) -> None:
        if not self.proper:
            values = f"lam={self.lam:g}, alpha={self.alpha:g}, beta={self.beta:g}"
            raise InputError(
                "NormalGamma",
                f"{values} is improper and has no {what}",
                "update it with more samples that are not all equal, or give lam, alpha and beta above zero",
            )
