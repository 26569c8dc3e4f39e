r"""The posterior of a law along the measured motion without a random force, as a sampler sees it.

.. math:: y \sim N(X b, \sigma^2 V), \quad b_j \sim N(0, s_j^2), \quad p(\sigma) \propto 1/\sigma

with ``V`` the variances of the clock and ``s`` the prior sd of the coefficients, half-normal where a
coefficient has to be positive: what :mod:`friction_bayes.statespace.force_target` has with a
random force. The closed form has the prior precision in units of the noise found with all columns.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.core.arrays import Array, Integers
from friction_bayes.statespace.force_target import (
    densities_of_half_cycles,
    no_prior_draws,
    replicated_records,
)
from friction_bayes.statespace.regression import LawRegression, near_least_squares
from friction_bayes.statespace.replication import drawn_noise

__all__ = ["sensor_noise_target"]

_LOG_LIMIT = 300.0


def sensor_noise_target(
    regression: LawRegression,
    *,
    natural: Callable[[Array, Array], dict[str, Array]],
    blocks: Integers,
    signal: Array,
    unit: float,
) -> Target:
    """Build the target of a regression given that there is no random force.

    Parameters
    ----------
    regression : LawRegression
        On one set of columns, see :meth:`LawRegression.of_columns`.
    natural : callable, (coefficients (m, p), noise sd (m,)) -> dict
        Natural parameters of draws, from those in natural units.
    blocks : ndarray of int, shape (b,)
        First sample of every half cycle.
    signal : ndarray, shape (n,)
        The record in its own unit.
    unit : float
        Natural unit in the unit of the signal.

    Returns
    -------
    Target
        Coordinates: the coefficients and ``log_variance`` of the sensor noise, natural units.
    """
    scale, positive = regression.scale, regression.positive
    n, p = int(np.count_nonzero(np.isfinite(regression.clock.variance))), scale.size
    # about least squares, so that no small difference of large sums is taken
    reference = near_least_squares(regression.whitened(np.zeros(p), 0.0, 1.0).gram)
    whitened = regression.whitened(reference, 0.0, 1.0)
    gram, log_determinant = whitened.gram, whitened.log_determinant
    quietest = regression.log_least_variance
    noise2 = max(float(gram[p, p]) / max(n - p, 1), regression.least_noise**2)
    precision = gram[:p, :p] + noise2 * np.eye(p)
    middle = reference + np.linalg.solve(precision, gram[:p, p] - noise2 * reference)

    def misfit(scaled: Array) -> Array:
        rest = np.column_stack([reference - scaled, np.ones(len(scaled))])
        return np.asarray(np.einsum("mi,ij,mj->m", rest, gram, rest))

    def log_prior(theta: Array) -> Array:
        scaled, log_v = theta[:, :-1] / scale, theta[:, -1]
        inside = (log_v >= quietest) & (np.abs(log_v) < _LOG_LIMIT)
        return np.where(inside, regression.log_prior_density(scaled), -np.inf)

    def log_prob(theta: Array) -> Array:
        out = log_prior(theta)
        use = np.isfinite(out)
        likelihood = signal_log_likelihood(misfit(theta[use, :-1] / scale), theta[use, -1], n)
        out[use] += likelihood - 0.5 * log_determinant
        return out

    def closed_form(theta: Array) -> Array:
        away, log_v = theta[:, :-1] / scale - middle, theta[:, -1]
        rest = float(misfit(middle[None])[0] + noise2 * middle @ middle)
        quadratic = np.einsum("mi,ij,mj->m", away, precision, away) + rest
        density = -0.5 * (n + p) * log_v - 0.5 * np.exp(-log_v) * quadratic
        return np.where(np.isfinite(log_prior(theta)), density, -np.inf)

    def pointwise(theta: Array) -> Array:
        forces = [(0.0, 1.0)] * len(theta)
        return densities_of_half_cycles(regression, blocks, theta[:, :-1], theta[:, -1], forces)

    def predictive(theta: Array, rng: np.random.Generator) -> Array:
        drawn = [math.exp(0.5 * row[-1]) * drawn_noise(regression.clock, rng) for row in theta]
        return replicated_records(regression, signal, unit, theta[:, :-1], drawn)

    covariance = np.zeros((p + 1, p + 1))
    covariance[:p, :p] = noise2 * np.linalg.inv(precision) * np.outer(scale, scale)
    covariance[p, p] = 2.0 / n
    sd = np.sqrt(np.diag(covariance))
    centre = np.append(middle * scale, math.log(noise2))
    # where the sampler starts has to lie inside the support
    centre[:p] = np.where(positive, np.maximum(centre[:p], 0.5 * sd[:p]), centre[:p])
    centre[p] = max(centre[p], quietest + 0.5 * sd[p])
    return Target(
        names=(*regression.names, "log_variance"),
        log_prob=log_prob,
        closed_form=closed_form,
        centre=centre,
        covariance=covariance,
        posterior=lambda theta: natural(theta[:, :-1], np.exp(0.5 * theta[:, -1])),
        log_prior=log_prior,
        pointwise=pointwise,
        predictive=predictive,
        prior_draws=no_prior_draws,
        observed=signal,
        observed_name="signal",
    )
