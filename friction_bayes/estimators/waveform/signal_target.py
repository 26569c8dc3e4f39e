"""The posterior of a whole signal as the sampler sees it: all coefficients, frequency and phase among them.

``log_prob`` uses the signal itself, so that a sampler checks the linearisation behind the closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.special import polygamma, psi

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.conjugate.regression import NormalInverseGamma
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.errors import InputError

__all__ = ["SignalModel", "signal_target"]


_LOG_LIMIT = 300.0
_CHUNK_VALUES = 4_000_000
"""Most samples of replicated signals held at a time."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SignalModel:
    """A forward model of the whole signal, as a function of its coefficients.

    Attributes
    ----------
    names : tuple of str
        Of the coefficients, length ``p``.
    scale : ndarray, shape (p,)
        Sampled coordinate over coefficient, which turns phase advances into frequencies.
    bounds : ndarray, shape (p, 2)
        Support of the coefficients; those without prior precision are uniform on it.
    signal : callable, (m, p) -> (m, n)
        Signals.
    misfit : callable, (m, p) -> (m,)
        Sums of squared residuals.
    blocks : ndarray of int, shape (b,)
        First sample of every half cycle.
    observed : ndarray, shape (n,)
        The samples.
    used : ndarray of bool, shape (n,)
        Which of them count.
    """

    names: tuple[str, ...]
    scale: Array
    bounds: Array
    signal: Callable[[Array], Array]
    misfit: Callable[[Array], Array]
    blocks: Integers
    observed: Array
    used: Mask


def signal_target(
    model: SignalModel, prior: NormalInverseGamma, posterior: NormalInverseGamma, *, force_factor: float
) -> Target:
    """Build the target of a whole-signal fit.

    Parameters
    ----------
    model : SignalModel
        The signal; ``friction_coefficient`` is among its names.
    prior, posterior : NormalInverseGamma
        Of its coefficients and the error variance; the posterior is that of the linearised signal.
    force_factor : float
        Factor from the friction coefficient to the friction force.

    Returns
    -------
    Target
        Coordinates: the coefficients times their scale, and ``log_variance``.
    """
    size, coefficients = len(model.names), posterior.coefficients
    covariance = np.zeros((size + 1, size + 1))
    covariance[:-1, :-1] = coefficients.shape * max(coefficients.df / max(coefficients.df - 2.0, 1.0), 1.0)
    covariance[:-1, :-1] *= np.outer(model.scale, model.scale)
    covariance[-1, -1] = polygamma(1, posterior.alpha)
    sampled = _SampledSignal(model, prior, posterior, force_factor)
    return Target(
        names=(*model.names, "log_variance"),
        log_prob=sampled.log_prob,
        closed_form=sampled.closed_form,
        centre=np.append(posterior.mean * model.scale, np.log(posterior.beta) - psi(posterior.alpha)),
        covariance=covariance,
        posterior=sampled.natural,
        log_prior=sampled.log_prior,
        pointwise=sampled.pointwise,
        predictive=sampled.predictive,
        prior_draws=sampled.prior_draws,
        observed=model.observed,
        observed_name="signal",
    )


class _Supported(NamedTuple):
    """Coefficients and log-variance, outside the support those of the centre, and which lie inside."""

    coefficients: Array
    log_variance: Array
    inside: Mask


@dataclass(frozen=True, eq=False)
class _SampledSignal:
    """The posterior of a whole signal, at a sampler's coordinates; fields as of :func:`signal_target`."""

    model: SignalModel
    prior: NormalInverseGamma
    posterior: NormalInverseGamma
    force_factor: float

    def _supported(self, theta: Array) -> _Supported:
        bounds = self.model.bounds
        inside = np.abs(theta[:, -1]) < _LOG_LIMIT
        coefficients = theta[:, :-1] / self.model.scale
        inside &= np.all((coefficients >= bounds[:, 0]) & (coefficients <= bounds[:, 1]), axis=1)
        coefficients = np.where(inside[:, None], coefficients, self.posterior.mean)
        return _Supported(coefficients, np.where(inside, theta[:, -1], 0.0), inside)

    def _prior_at(self, at: _Supported) -> Array:
        density = self.prior.logpdf if self.prior.proper else self.prior.log_kernel
        return np.asarray(density(at.coefficients, np.exp(at.log_variance)) + at.log_variance)

    def log_prior(self, theta: Array) -> Array:
        at = self._supported(theta)
        return np.where(at.inside, self._prior_at(at), -np.inf)

    def log_prob(self, theta: Array) -> Array:
        at, used = self._supported(theta), int(np.count_nonzero(self.model.used))
        misfit = self.model.misfit(at.coefficients)
        value = self._prior_at(at) + signal_log_likelihood(misfit, at.log_variance, used)
        return np.where(at.inside, value, -np.inf)

    def closed_form(self, theta: Array) -> Array:
        inside = np.abs(theta[:, -1]) < _LOG_LIMIT
        log_v = np.where(inside, theta[:, -1], 0.0)
        density = self.posterior.logpdf(theta[:, :-1] / self.model.scale, np.exp(log_v)) + log_v
        return np.where(inside, density, -np.inf)

    def natural(self, theta: Array) -> dict[str, Array]:
        names = self.model.names
        friction = names.index("friction_coefficient")
        others = {name: theta[:, i] for i, name in enumerate(names) if i != friction}
        force = self.force_factor / self.model.scale[friction] * theta[:, friction]
        return {"friction": force, **others, "precision": np.exp(-theta[:, -1])}

    def pointwise(self, theta: Array) -> Array:
        model = self.model
        counts = np.add.reduceat(model.used.astype(float), model.blocks)
        rows = max(_CHUNK_VALUES // model.observed.size, 1)
        squares = [
            np.add.reduceat(
                model.used * (model.observed - model.signal(part / model.scale)) ** 2, model.blocks, axis=1
            )
            for part in np.split(theta[:, :-1], range(rows, len(theta), rows))
        ]
        return np.asarray(
            -0.5 * counts * (np.log(2.0 * np.pi) + theta[:, -1:])
            - 0.5 * np.concatenate(squares) * np.exp(-theta[:, -1:])
        )

    def predictive(self, theta: Array, rng: np.random.Generator) -> Array:
        noise = rng.standard_normal((len(theta), self.model.observed.size)) * np.exp(0.5 * theta[:, -1:])
        return self.model.signal(np.ascontiguousarray(theta[:, :-1] / self.model.scale)) + noise

    def prior_draws(self, rng: np.random.Generator, count: int) -> Array:
        prior, (low, high) = self.prior, self.model.bounds.T
        alpha = _proper_shape(prior, self.model.bounds)
        log_v = np.log(prior.beta) - stats.loggamma.rvs(alpha, size=count, random_state=rng)
        weight = np.diag(prior.factor)
        flat = weight == 0.0
        unit = rng.standard_normal((count, low.size)) / np.where(flat, 1.0, weight)
        normal = prior.mean + unit * np.exp(0.5 * log_v)[:, None]
        share = rng.random((count, low.size))
        uniform = np.where(flat, low, 0.0) + np.where(flat, high - low, 0.0) * share
        return np.column_stack([np.where(flat, uniform, normal) * self.model.scale, log_v])


def _proper_shape(prior: NormalInverseGamma, bounds: Array) -> float:
    """Shape of the error variance given apart from the coefficients that are uniform on their support."""
    flat = np.diag(prior.factor) == 0.0
    alpha = prior.alpha + 0.5 * np.count_nonzero(flat)
    if alpha <= 0.0 or prior.beta <= 0.0 or not np.all(np.isfinite(bounds[flat])):
        raise InputError(
            "prior",
            f"alpha={alpha:g}, beta={prior.beta:g} is improper",
            "give a proper prior",
        )
    return alpha
