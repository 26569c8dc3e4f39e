"""The three conjugate posteriors as the sampler sees them: unconstrained coordinates, Jacobian included.

``log_prob`` is made of the shared likelihood and the prior alone, ``closed_form`` of the posterior alone, so
that their difference, the log-evidence, is a constant exactly where the closed form is right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats
from scipy.special import polygamma, psi

from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.likelihood import (
    Target,
    exponential_log_likelihood,
    exponential_pointwise,
    normal_log_likelihood,
    normal_pointwise,
    regression_log_likelihood,
    regression_pointwise,
)
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.conjugate.sufficient_statistics import NormalStatistics, RegressionStatistics
from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite_array, positive
from friction_bayes.core.errors import InputError

__all__ = ["gamma_exponential_target", "normal_gamma_target", "regression_target"]

_LOG_LIMIT = 300.0
"""Largest logarithm of a scale parameter that is looked at: beyond exp(300) squares overflow."""


def normal_gamma_target(prior: NormalGamma, samples: ArrayLike) -> Target:
    """Posterior of friction and log-precision after friction samples.

    Parameters
    ----------
    prior : NormalGamma
        Prior of the friction force.
    samples : array_like
        Friction samples [unit of friction], any shape.

    Returns
    -------
    Target
        Coordinates ``friction`` and ``log_precision``; improper priors enter without their constant.
    """
    x = finite_array("samples", samples).ravel()
    data = NormalStatistics.of(x)
    posterior = prior.update(x)
    prior_density = prior.logpdf if prior.proper else prior.log_kernel

    def log_prior(theta: Array) -> Array:
        return _where_finite(theta[:, 1], lambda s: prior_density(theta[:, 0], s) + np.log(s))

    def log_prob(theta: Array) -> Array:
        likelihood = _where_finite(theta[:, 1], lambda s: normal_log_likelihood(theta[:, 0], s, data))
        return likelihood + log_prior(theta)

    def closed_form(theta: Array) -> Array:
        return _where_finite(theta[:, 1], lambda s: posterior.logpdf(theta[:, 0], s) + np.log(s))

    def predictive(theta: Array, rng: np.random.Generator) -> Array:
        noise = rng.standard_normal((len(theta), x.size))
        return theta[:, :1] + noise * np.exp(-0.5 * theta[:, 1:])

    def prior_draws(rng: np.random.Generator, size: int) -> Array:
        prior.rvs(0, rng)  # refuses an improper prior
        log_s = _log_gamma_draws(prior.alpha, prior.beta, size, rng)
        noise = rng.standard_normal(size) / np.sqrt(prior.lam)
        return np.column_stack([prior.mu + noise * np.exp(-0.5 * log_s), log_s])

    friction = posterior.friction
    return Target(
        names=("friction", "log_precision"),
        log_prob=log_prob,
        closed_form=closed_form,
        centre=np.array([posterior.mu, psi(posterior.alpha) - np.log(posterior.beta)]),
        covariance=np.diag([_t_variance(friction), float(polygamma(1, posterior.alpha))]),
        posterior=lambda theta: {"friction": theta[:, 0], "precision": np.exp(theta[:, 1])},
        log_prior=log_prior,
        pointwise=lambda theta: normal_pointwise(theta[:, 0], np.exp(theta[:, 1]), x),
        predictive=predictive,
        prior_draws=prior_draws,
        observed=x,
        observed_name="friction_sample",
    )


def gamma_exponential_target(prior: GammaExponential, samples: ArrayLike) -> Target:
    """Posterior of the logarithm of the exponential rate that the paper takes for friction.

    Parameters
    ----------
    prior : GammaExponential
        Prior of the rate.
    samples : array_like
        Friction samples, any shape; negative ones enter the formal likelihood.

    Returns
    -------
    Target
        Coordinate ``log_friction``; an improper prior enters without its constant.
    """
    x = finite_array("samples", samples).ravel()
    total = float(x.sum())
    posterior = prior.update(x)
    prior_density = prior.logpdf if prior.proper else prior.log_kernel

    def log_prior(theta: Array) -> Array:
        return _where_finite(theta[:, 0], lambda r: prior_density(r) + np.log(r))

    def log_prob(theta: Array) -> Array:
        likelihood = _where_finite(
            theta[:, 0], lambda r: exponential_log_likelihood(r, n=x.size, total=total)
        )
        return likelihood + log_prior(theta)

    def prior_draws(rng: np.random.Generator, size: int) -> Array:
        prior.rvs(0, rng)  # refuses an improper prior
        return _log_gamma_draws(prior.alpha, prior.kappa, size, rng)[:, None]

    return Target(
        names=("log_friction",),
        log_prob=log_prob,
        closed_form=lambda theta: _where_finite(theta[:, 0], lambda r: posterior.logpdf(r) + np.log(r)),
        centre=np.array([psi(posterior.alpha) - np.log(posterior.kappa)]),
        covariance=np.array([[float(polygamma(1, posterior.alpha))]]),
        posterior=lambda theta: {"friction": np.exp(theta[:, 0])},
        log_prior=log_prior,
        pointwise=lambda theta: exponential_pointwise(np.exp(theta[:, 0]), x),
        predictive=lambda theta, rng: rng.exponential(np.exp(-theta), (len(theta), x.size)),
        prior_draws=prior_draws,
        observed=x,
        observed_name="friction_sample",
    )


def regression_target(
    prior: NormalInverseGamma,
    design: ArrayLike,
    response: ArrayLike,
    *,
    names: Sequence[str],
    friction: str,
    force_factor: float = 1.0,
    observed_name: str = "response",
) -> Target:
    """Posterior of regression coefficients and log-variance.

    Parameters
    ----------
    prior : NormalInverseGamma
        Prior of the coefficients and the error variance.
    design : array_like, shape (n, p)
        Design matrix.
    response : array_like, shape (n,)
        What it explains.
    names : sequence of str, length p
        Names of the coefficients.
    friction : str
        The one of ``names`` that is the signal's friction coefficient.
    force_factor : float
        Factor from it to the friction force.
    observed_name : str
        Name of the response in ``observed_data``.

    Returns
    -------
    Target
        Coordinates ``names`` and ``log_variance``. ``posterior`` gives the friction *force*, the other
        coefficients under their names and ``precision``, the inverse of the variance.
    """
    if len(names) != prior.size or friction not in names:
        known = ", ".join(names)
        raise InputError(
            "names", f"{known} of {prior.size} coefficients", f"name each, {friction} among them"
        )
    x, y = finite_array("design", design), finite_array("response", response)
    data = RegressionStatistics.of(x, y)
    posterior = prior.update_statistics(data)
    factor, column = positive("force_factor", force_factor), list(names).index(friction)
    prior_density = prior.logpdf if prior.proper else prior.log_kernel

    def log_prior(theta: Array) -> Array:
        return _where_finite(theta[:, -1], lambda v: prior_density(theta[:, :-1], v) + np.log(v))

    def log_prob(theta: Array) -> Array:
        likelihood = _where_finite(theta[:, -1], lambda v: regression_log_likelihood(theta[:, :-1], v, data))
        return likelihood + log_prior(theta)

    def natural(theta: Array) -> dict[str, Array]:
        others = {name: theta[:, i] for i, name in enumerate(names) if i != column}
        return {"friction": factor * theta[:, column], **others, "precision": np.exp(-theta[:, -1])}

    def predictive(theta: Array, rng: np.random.Generator) -> Array:
        noise = rng.standard_normal((len(theta), y.size))
        return theta[:, :-1] @ x.T + noise * np.exp(0.5 * theta[:, -1:])

    def prior_draws(rng: np.random.Generator, size: int) -> Array:
        prior.rvs(0, rng)  # refuses an improper prior
        log_v = -_log_gamma_draws(prior.alpha, prior.beta, size, rng)
        unit = np.linalg.solve(prior.factor, rng.standard_normal((prior.size, size))).T
        return np.column_stack([prior.mean + unit * np.exp(0.5 * log_v)[:, None], log_v])

    coefficients = posterior.coefficients
    spread = _t_variance(stats.t(df=coefficients.df))
    covariance = np.zeros((prior.size + 1, prior.size + 1))
    covariance[:-1, :-1] = coefficients.shape * spread
    covariance[-1, -1] = polygamma(1, posterior.alpha)
    return Target(
        names=(*names, "log_variance"),
        log_prob=log_prob,
        closed_form=lambda theta: _where_finite(
            theta[:, -1], lambda v: posterior.logpdf(theta[:, :-1], v) + np.log(v)
        ),
        centre=np.append(posterior.mean, np.log(posterior.beta) - psi(posterior.alpha)),
        covariance=covariance,
        posterior=natural,
        log_prior=log_prior,
        pointwise=lambda theta: regression_pointwise(theta[:, :-1], np.exp(theta[:, -1]), x, y),
        predictive=predictive,
        prior_draws=prior_draws,
        observed=y,
        observed_name=observed_name,
    )


def _where_finite(log_scale: Array, density: Callable[[Array], Array]) -> Array:
    """Evaluate a log-density at ``exp(log_scale)``; -inf where that is beyond the range of the arithmetic."""
    inside = np.abs(log_scale) < _LOG_LIMIT
    return np.where(inside, density(np.exp(np.where(inside, log_scale, 0.0))), -np.inf)


def _log_gamma_draws(shape: float, rate: float, size: int, rng: np.random.Generator) -> Array:
    """Logarithms of gamma draws, exact where a small shape makes the draws themselves underflow."""
    return stats.loggamma.rvs(shape, size=size, random_state=rng) - np.log(rate)


def _t_variance(t: Any) -> float:
    """Variance of a Student t; with few degrees of freedom the half-width of its central 68 %, squared."""
    if t.kwds["df"] >= 4.0:
        return float(t.var())
    # from the scale: about a location a narrow one has lost its width to rounding
    half = stats.t.ppf(0.5 * (1.0 + 0.6827), t.kwds["df"]) * t.kwds.get("scale", 1.0)
    return float(half**2)
