r"""The posterior of a law along the measured motion without a random force, as a sampler sees it.

.. math:: y \sim N(X b, \sigma^2 V), \quad b_j \sim N(0, s_j^2), \quad p(\sigma) \propto 1/\sigma

with ``V`` the variances of the clock and ``s`` the prior sd of the coefficients, half-normal where a
coefficient has to be positive: what :mod:`friction_bayes.statespace.force_target` has with a
random force. The closed form has the prior precision in units of the noise found with all columns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.core.arrays import Array, Integers
from friction_bayes.statespace.force_target import (
    densities_of_half_cycles,
    no_prior_draws,
    replicated_records,
)
from friction_bayes.statespace.kalman import Whitened
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
    """The target of a regression given that there is no random force.

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
    n, p, scale = _samples(regression), regression.scale.size, regression.scale
    quiet = _Quiet.of(regression, natural, blocks, signal, unit)
    covariance = np.zeros((p + 1, p + 1))
    covariance[:p, :p] = quiet.noise2 * np.linalg.inv(quiet.precision) * np.outer(scale, scale)
    covariance[p, p] = 2.0 / n
    sd = np.sqrt(np.diag(covariance))
    centre = np.append(quiet.middle * scale, math.log(quiet.noise2))
    # the sampler has to start inside the support
    centre[:p] = np.where(regression.positive, np.maximum(centre[:p], 0.5 * sd[:p]), centre[:p])
    centre[p] = max(centre[p], regression.log_least_variance + 0.5 * sd[p])
    return Target(
        names=(*regression.names, "log_variance"),
        log_prob=quiet.log_prob,
        closed_form=quiet.closed_form,
        centre=centre,
        covariance=covariance,
        posterior=quiet.posterior,
        log_prior=quiet.log_prior,
        pointwise=quiet.pointwise,
        predictive=quiet.predictive,
        prior_draws=no_prior_draws,
        observed=signal,
        observed_name="signal",
    )


@dataclass(frozen=True, eq=False)
class _Quiet:
    """The posterior without a random force, at a sampler's coordinates.

    Fields are the parameters of :func:`sensor_noise_target`, a reference law and the sums about it, and of
    the closed form middle and precision of the coefficients, in units of their prior sd, and noise variance.
    """

    regression: LawRegression
    natural: Callable[[Array, Array], dict[str, Array]]
    blocks: Integers
    signal: Array
    unit: float
    reference: Array
    whitened: Whitened
    middle: Array
    precision: Array
    noise2: float

    @classmethod
    def of(
        cls,
        regression: LawRegression,
        natural: Callable[[Array, Array], dict[str, Array]],
        blocks: Integers,
        signal: Array,
        unit: float,
    ) -> _Quiet:
        p = regression.scale.size
        # about least squares, so that no small difference of large sums is taken
        reference = near_least_squares(regression.whitened(np.zeros(p), 0.0, 1.0).gram)
        whitened = regression.whitened(reference, 0.0, 1.0)
        gram, freedom = whitened.gram, max(_samples(regression) - p, 1)
        noise2 = max(float(gram[p, p]) / freedom, regression.least_noise**2)
        precision = gram[:p, :p] + noise2 * np.eye(p)
        middle = reference + np.linalg.solve(precision, gram[:p, p] - noise2 * reference)
        return cls(regression, natural, blocks, signal, unit, reference, whitened, middle, precision, noise2)

    def _misfit(self, scaled: Array) -> Array:
        rest = np.column_stack([self.reference - scaled, np.ones(len(scaled))])
        return np.asarray(np.einsum("mi,ij,mj->m", rest, self.whitened.gram, rest))

    def log_prior(self, theta: Array) -> Array:
        scaled, log_v = theta[:, :-1] / self.regression.scale, theta[:, -1]
        inside = (log_v >= self.regression.log_least_variance) & (np.abs(log_v) < _LOG_LIMIT)
        return np.where(inside, self.regression.log_prior_density(scaled), -np.inf)

    def log_prob(self, theta: Array) -> Array:
        out = self.log_prior(theta)
        use = np.isfinite(out)
        misfit = self._misfit(theta[use, :-1] / self.regression.scale)
        likelihood = signal_log_likelihood(misfit, theta[use, -1], _samples(self.regression))
        out[use] += likelihood - 0.5 * self.whitened.log_determinant
        return out

    def closed_form(self, theta: Array) -> Array:
        n, p, middle = _samples(self.regression), self.middle.size, self.middle
        away, log_v = theta[:, :-1] / self.regression.scale - middle, theta[:, -1]
        rest = float(self._misfit(middle[None])[0] + self.noise2 * middle @ middle)
        quadratic = np.einsum("mi,ij,mj->m", away, self.precision, away) + rest
        density = -0.5 * (n + p) * log_v - 0.5 * np.exp(-log_v) * quadratic
        return np.where(np.isfinite(self.log_prior(theta)), density, -np.inf)

    def posterior(self, theta: Array) -> dict[str, Array]:
        return self.natural(theta[:, :-1], np.exp(0.5 * theta[:, -1]))

    def pointwise(self, theta: Array) -> Array:
        forces = [(0.0, 1.0)] * len(theta)
        return densities_of_half_cycles(self.regression, self.blocks, theta[:, :-1], theta[:, -1], forces)

    def predictive(self, theta: Array, rng: np.random.Generator) -> Array:
        drawn = [math.exp(0.5 * row[-1]) * drawn_noise(self.regression.clock, rng) for row in theta]
        return replicated_records(self.regression, self.signal, self.unit, theta[:, :-1], drawn)


def _samples(regression: LawRegression) -> int:
    return int(np.count_nonzero(np.isfinite(regression.clock.variance)))
