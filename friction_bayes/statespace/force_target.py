r"""The posterior under a random force as a sampler sees it: every parameter free.

.. math:: y \sim N(X b, \sigma^2 V(q/\sigma, \tau)), \quad b_j \sim N(0, s_j^2), \quad
          p(\sigma) \propto 1/\sigma, \quad \log q \sim N, \quad \log\tau \sim U

with ``s`` the prior sd of the coefficients, half-normal where a coefficient has to be positive, and the prior
of ``q`` and ``tau`` that of :class:`friction_bayes.statespace.force_prior.ForcePrior`. Likelihood
and Gram matrices are those of the closed form, whose approximations are not used here, so that a sampler
checks them: the prior precision of ``b`` in units of the noise found with all columns, the prior of ``q`` at
the noise found given ``q/sigma`` and ``tau``, normals for Student t distributions of hundreds of degrees of
freedom, the grid, and the moments of ``q`` and ``tau``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.force_grid import valleys
from friction_bayes.statespace.force_prior import ForcePrior, at_resonance
from friction_bayes.statespace.interpolated_sums import InterpolatedSums
from friction_bayes.statespace.kalman import Whitened, shown
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.replication import drawn_fluctuation, drawn_noise
from friction_bayes.statespace.subset_evidence import WeighedSets, set_posterior

__all__ = [
    "densities_of_half_cycles",
    "force_target",
    "half_cycle_blocks",
    "no_prior_draws",
    "replicated_records",
    "still_target",
]

_REACH = 6.0
"""Prior standard deviations of ``log q`` within which the posterior is looked for."""
_COARSE = 0.5
"""Step of that search in ``u`` and in ``log tau``."""
_DEPTH = 25.0
"""Nats below the best place, integrated over coefficients and noise, beyond which nothing is sampled."""
_FINE = (56, 40)
"""Steps of the interpolation in ``u`` and in ``log tau``."""
_LOG_LIMIT = 300.0
_NO_FORCE = (0.0, 1.0)
"""Its size over the noise, and any correlation time."""


@dataclass(frozen=True, eq=False)
class _Coordinates:
    """Columns of a sampler's coordinates by name."""

    scaled: Array
    log_variance: Array
    log_q: Array
    log_tau: Array

    @classmethod
    def of(cls, theta: Array, scale: Array) -> _Coordinates:
        return cls(theta[:, :-3] / scale, *theta[:, -3:].T)

    @property
    def places(self) -> Array:
        """``(u, l)``, shape (m, 2)."""
        log_ratio = self.log_q - 0.5 * self.log_variance
        return np.column_stack([log_ratio + np.log(at_resonance(np.exp(self.log_tau))), self.log_tau])


def force_target(
    regression: LawRegression,
    prior: ForcePrior,
    *,
    natural: Callable[[Array, Array, Array, Array], dict[str, Array]],
    blocks: Integers,
    signal: Array,
    unit: float,
) -> Target:
    """Build the target of a regression given that there is a random force.

    Parameters
    ----------
    regression : LawRegression
        On one set of columns, see :meth:`LawRegression.of_columns`.
    prior : ForcePrior
        Of the random force.
    natural : callable, (coefficients (m, p), noise sd (m,), q (m,), tau (m,)) -> dict
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
        Coordinates: the coefficients, ``log_variance`` of the sensor noise, ``log_force_sd`` and
        ``log_correlation_time``, natural units. ``pointwise`` is the density of each half cycle given those
        before it: under a random force half cycles are not independent given the parameters.
    """
    axes = _axes(Problem.of(regression), prior, regression.motion.noise)
    sums = InterpolatedSums.over(axes, lambda u, log_tau: regression.whiten_at(*_force(u, log_tau)))
    centre, covariance, humps = _moments(regression, prior, axes, sums)
    forced = _Forced(regression, prior, sums, natural, blocks, signal, unit)
    return Target(
        names=(*regression.names, "log_variance", "log_force_sd", "log_correlation_time"),
        log_prob=forced.log_prob,
        closed_form=forced.closed_form,
        centre=centre,
        covariance=covariance,
        posterior=forced.posterior,
        log_prior=forced.log_prior,
        pointwise=forced.pointwise,
        predictive=forced.predictive,
        prior_draws=no_prior_draws,
        observed=signal,
        observed_name="signal",
        humps=humps,
    )


@dataclass(frozen=True, eq=False)
class _Forced:
    """The posterior under a random force, at a sampler's coordinates.

    Fields are the parameters of :func:`force_target`, and the whitened sums of record and columns by place.
    """

    regression: LawRegression
    prior: ForcePrior
    sums: InterpolatedSums
    natural: Callable[[Array, Array, Array, Array], dict[str, Array]]
    blocks: Integers
    signal: Array
    unit: float

    def log_prior(self, theta: Array) -> Array:
        return self._prior_at(_Coordinates.of(theta, self.regression.scale))

    def _prior_at(self, at: _Coordinates) -> Array:
        force = self.prior.log_density(np.exp(at.log_q), np.exp(at.log_tau))
        law = self.regression.log_prior_density(at.scaled)
        return np.where(at.log_variance >= self.regression.log_least_variance, law + force, -np.inf)

    def log_prob(self, theta: Array) -> Array:
        regression = self.regression
        at = _Coordinates.of(theta, regression.scale)
        places = at.places
        out = np.full(len(theta), -np.inf)
        use = np.flatnonzero(self.sums.inside(places) & (np.abs(at.log_variance) < _LOG_LIMIT))
        if use.size:
            factors, log_determinant = self.sums.at(places[use])
            misfit = _misfit(factors, regression.reference - at.scaled[use])
            likelihood = signal_log_likelihood(misfit, at.log_variance[use], _samples(regression))
            out[use] = likelihood - 0.5 * log_determinant + self._prior_at(at)[use]
        return out

    def closed_form(self, theta: Array) -> Array:
        n = _samples(self.regression)
        return np.array(
            [_closed_form(self._uncut, self.regression.positive, self.prior, n, row) for row in theta]
        )

    @cached_property
    def _uncut(self) -> LawRegression:
        """The same, coefficients of either sign: the mass that is cut off cancels in the product."""
        regression = self.regression
        free = np.zeros_like(regression.positive)
        return replace(regression, positive=free, near=regression.reference)

    def posterior(self, theta: Array) -> dict[str, Array]:
        noise, q, tau = np.exp(0.5 * theta[:, -3]), np.exp(theta[:, -2]), np.exp(theta[:, -1])
        return self.natural(theta[:, :-3], noise, q, tau)

    def pointwise(self, theta: Array) -> Array:
        at = _Coordinates.of(theta, self.regression.scale)
        forces = [_force(*place) for place in at.places]
        return densities_of_half_cycles(self.regression, self.blocks, theta[:, :-3], at.log_variance, forces)

    def predictive(self, theta: Array, rng: np.random.Generator) -> Array:
        clock, row = self.regression.clock, self.regression.row
        noises = [math.exp(0.5 * one[-3]) * drawn_noise(clock, rng) for one in theta]
        forces = [
            math.exp(one[-2]) * shown(drawn_fluctuation(clock, math.exp(one[-1]), rng), row) for one in theta
        ]
        drawn = [force + noise for force, noise in zip(forces, noises, strict=True)]
        return replicated_records(self.regression, self.signal, self.unit, theta[:, :-3], drawn)


def still_target(
    regression: LawRegression,
    *,
    natural: Callable[[Array, Array], dict[str, Array]],
    blocks: Integers,
    signal: Array,
    unit: float,
) -> Target:
    """Build the target of a regression without a random force, under the noise that its clock describes.

    Parameters
    ----------
    regression : LawRegression
        On one set of columns.
    natural : callable, (coefficients (m, p), noise sd (m,)) -> dict
        Natural parameters of draws, from those in natural units.
    blocks, signal, unit
        As for :func:`force_target`.

    Returns
    -------
    Target
        Coordinates: the coefficients and ``log_variance`` of the sensor noise, natural units.
    """
    scale, n, p = regression.scale, _samples(regression), regression.scale.size
    found = Problem.of(regression).weigh(*_NO_FORCE)
    whitened = regression.whiten_at(*_NO_FORCE)
    lam, noise2 = found.full_noise2, float(found.noise2[0])
    gram, everything = whitened.gram, np.ones(p, dtype=np.bool_)
    mean, covariance = set_posterior(gram, regression.reference, everything, lam, noise2)
    precision = gram[:-1, :-1] + lam * np.eye(p)
    centre = np.append(
        mean * scale, math.log(noise2) + (math.sqrt(0.5 / n) if regression.least_noise else 0.0)
    )
    spread = np.zeros((p + 1, p + 1))
    spread[:-1, :-1] = covariance * np.outer(scale, scale)
    spread[-1, -1] = 2.0 / n
    still = _Still(regression, whitened, mean, precision, noise2, natural, blocks, signal, unit)
    return Target(
        names=(*regression.names, "log_variance"),
        log_prob=still.log_prob,
        closed_form=still.closed_form,
        centre=centre,
        covariance=spread,
        posterior=still.posterior,
        log_prior=still.log_prior,
        pointwise=still.pointwise,
        predictive=still.predictive,
        prior_draws=no_prior_draws,
        observed=signal,
        observed_name="signal",
    )


@dataclass(frozen=True, eq=False)
class _Still:
    """The posterior without a random force, at a sampler's coordinates.

    Fields are the parameters of :func:`still_target`, the whitened sums, and of the closed form the mean and
    precision of the coefficients in units of their prior sd and the noise variance.
    """

    regression: LawRegression
    whitened: Whitened
    mean: Array
    precision: Array
    noise2: float
    natural: Callable[[Array, Array], dict[str, Array]]
    blocks: Integers
    signal: Array
    unit: float

    @cached_property
    def _factor(self) -> Array:
        return np.asarray(np.linalg.cholesky(self.whitened.gram).T[None], dtype=np.float64)

    def log_prior(self, theta: Array) -> Array:
        log_v = theta[:, -1]
        law = self.regression.log_prior_density(theta[:, :-1] / self.regression.scale)
        inside = (log_v >= self.regression.log_least_variance) & (np.abs(log_v) < _LOG_LIMIT)
        return np.where(inside, law, -np.inf)

    def log_prob(self, theta: Array) -> Array:
        regression, whitened = self.regression, self.whitened
        log_v = np.clip(theta[:, -1], -_LOG_LIMIT, _LOG_LIMIT)
        misfit = _misfit(self._factor, regression.reference - theta[:, :-1] / regression.scale)
        likelihood = signal_log_likelihood(misfit, log_v, whitened.used) - 0.5 * whitened.log_determinant
        return np.asarray(likelihood + self.log_prior(theta))

    def closed_form(self, theta: Array) -> Array:
        n, p = self.whitened.used, self.mean.size
        away, log_v = theta[:, :-1] / self.regression.scale - self.mean, theta[:, -1]
        square = np.einsum("mi,ij,mj->m", away, self.precision, away) + n * self.noise2
        return np.asarray(-0.5 * (n + p) * log_v - 0.5 * square * np.exp(-log_v))

    def posterior(self, theta: Array) -> dict[str, Array]:
        return self.natural(theta[:, :-1], np.exp(0.5 * theta[:, -1]))

    def pointwise(self, theta: Array) -> Array:
        forces = [_NO_FORCE] * len(theta)
        return densities_of_half_cycles(self.regression, self.blocks, theta[:, :-1], theta[:, -1], forces)

    def predictive(self, theta: Array, rng: np.random.Generator) -> Array:
        drawn = [math.exp(0.5 * row[-1]) * drawn_noise(self.regression.clock, rng) for row in theta]
        return replicated_records(self.regression, self.signal, self.unit, theta[:, :-1], drawn)


def densities_of_half_cycles(
    regression: LawRegression,
    blocks: Integers,
    laws: Array,
    log_variance: Array,
    forces: Sequence[tuple[float, float]],
) -> Array:
    """Log density of each half cycle given those before it, by draw, shape (m, b)."""
    rows = [
        np.add.reduceat(regression.log_densities(law, math.exp(log_v), *force), blocks)
        for law, log_v, force in zip(laws, log_variance, forces, strict=True)
    ]
    return np.array(rows)


def replicated_records(
    regression: LawRegression, signal: Array, unit: float, laws: Array, drawn: Sequence[Array]
) -> Array:
    """Replicated records of each law and its other parameters, shape (m, n), unit of the signal."""
    pairs = zip(laws, drawn, strict=True)
    return np.array([signal + unit * (other - regression.residual(law)) for law, other in pairs])


def no_prior_draws(rng: np.random.Generator, count: int) -> Array:
    """Refuse to draw from a prior under which every size of the noise is as probable as any other."""
    raise InputError("prior", "that of the noise is improper", "draw from a proper prior")


def half_cycle_blocks(phase: Array) -> Integers:
    """First sample of each half cycle of a clock, shape (n,); what is left over goes with the last."""
    half_cycles = (phase - phase[0]) / math.pi
    starts = np.searchsorted(half_cycles, np.arange(max(int(half_cycles[-1]), 1)))
    return np.asarray(np.unique(starts), dtype=np.int64)


def _force(u: float, log_tau: float) -> tuple[float, float]:
    """``q / sigma`` and ``tau`` of a place."""
    tau = math.exp(log_tau)
    return math.exp(u) / float(at_resonance(tau)), tau


def _misfit(factors: Array, rest: Array) -> Array:
    """Whitened sums of squares, shape (m,), of ``y - X b`` with ``rest`` = reference - b, shape (m, p)."""
    whitened = (factors[:, :, :-1] @ rest[:, :, None])[:, :, 0] + factors[:, :, -1]
    return np.asarray((whitened**2).sum(axis=1))


def _samples(regression: LawRegression) -> int:
    return int(np.count_nonzero(np.isfinite(regression.clock.variance)))


def _axes(problem: Problem, prior: ForcePrior, noise: float) -> tuple[Array, Array]:
    """Axes of the smallest rectangle of ``(u, l)`` that contains the posterior except a negligible part."""
    tau = np.exp(np.linspace(math.log(prior.tau_low), math.log(prior.tau_high), 12))
    middle = math.log(prior.centre / noise)
    reach = _REACH * prior.spread
    steps = math.ceil(2.0 * reach / _COARSE)
    u = np.linspace(middle - reach + math.log(np.min(at_resonance(tau))), middle + reach, steps)
    value = np.empty((u.size, tau.size))
    for i, j in np.ndindex(*value.shape):
        place = float(u[i]), math.log(tau[j])
        value[i, j] = _log_weight(problem.weigh(*_force(*place)), prior, *place)
    near = np.argwhere(value > value.max() - _DEPTH)
    low, high = np.maximum(near.min(axis=0) - 1, 0), near.max(axis=0) + 1
    ends = [
        (axis[a], axis[min(b, axis.size - 1)]) for axis, a, b in zip((u, np.log(tau)), low, high, strict=True)
    ]
    first, second = (np.linspace(*end, steps + 1) for end, steps in zip(ends, _FINE, strict=True))
    return first, second


def _log_weight(found: WeighedSets, prior: ForcePrior, u: float, log_tau: float) -> float:
    """Log evidence of a place times the prior there, at the noise found there."""
    ratio, tau = _force(u, log_tau)
    q = ratio * math.sqrt(found.noise2[0])
    # the ends of the range of tau belong to it, whichever way they round
    within = min(max(tau, prior.tau_low), prior.tau_high)
    tau = within if math.isclose(tau, within, rel_tol=1e-9) else tau
    return float(found.log_weight[0] + prior.log_density(q, tau))


def _moments(
    regression: LawRegression, prior: ForcePrior, axes: tuple[Array, Array], sums: InterpolatedSums
) -> tuple[Array, Array, tuple[tuple[Array, Array], ...]]:
    """Mean and covariance of the closed form in the sampler's coordinates, by sums over the grid.

    And of each of its modes, where there are several: the correlation times between two valleys.
    """
    p, scale = len(regression.names), regression.scale
    n = _samples(regression)
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    factors, log_determinant = sums.at(places)
    upper, right, least = factors[:, :p, :p], factors[:, :p, p], factors[:, p, p] ** 2
    quietest = regression.least_noise**2
    lam = np.maximum(least / max(n - p, 1), quietest)
    precision = upper.mT @ upper + lam[:, None, None] * np.eye(p)
    inverse = np.linalg.inv(precision)
    change = (upper.mT @ right[:, :, None])[:, :, 0] - lam[:, None] * regression.reference
    moved = (inverse @ change[:, :, None])[:, :, 0]
    mean = regression.reference + moved
    free_noise2 = (_misfit(factors, -moved) + lam * (mean**2).sum(axis=1)) / n
    noise2 = np.maximum(free_noise2, quietest)
    log_tau = np.clip(places[:, 1], math.log(prior.tau_low), math.log(prior.tau_high))
    log_ratio = places[:, 0] - np.log(at_resonance(np.exp(log_tau)))
    log_q = log_ratio + 0.5 * np.log(noise2)
    weight = prior.log_density(np.exp(log_q), np.exp(log_tau)) - 0.5 * (log_determinant + n * np.log(noise2))
    weight -= 0.5 * n * free_noise2 / noise2
    weight += 0.5 * p * np.log(lam) - 0.5 * np.linalg.slogdet(precision)[1]
    each = np.column_stack([mean * scale, np.log(noise2), log_q, log_tau])

    def moments(within: Mask) -> tuple[Array, Array]:
        own = np.where(within, weight, -math.inf)
        share = np.exp(own - logsumexp(own))
        centre = share @ each
        away = each - centre
        covariance = (share[:, None] * away).T @ away
        covariance[:p, :p] += np.einsum("g,gij->ij", share * noise2, inverse) * np.outer(scale, scale)
        # the noise variance given the place, and the force's sd with it
        covariance[p : p + 2, p : p + 2] += np.array([[2.0, 1.0], [1.0, 0.5]]) / n
        return centre, covariance

    centre, covariance = moments(np.ones(len(weight), dtype=np.bool_))
    crest = weight.reshape(axes[0].size, axes[1].size).max(axis=0)
    stretch = np.searchsorted(axes[1][valleys(crest)], places[:, 1])
    humps = [moments(stretch == k) for k in range(stretch.max() + 1)] if stretch.any() else []
    for _, spread in humps:
        # one may be narrower than a cell
        spread[-2:, -2:] += np.diag([(axis[1] - axis[0]) ** 2 / 12.0 for axis in axes])
    # the sampler has to start inside the support
    sd = np.sqrt(np.diag(covariance))
    centre[:p] = np.where(regression.positive, np.maximum(centre[:p], 0.5 * sd[:p]), centre[:p])
    if quietest > 0.0:
        centre[p] = max(centre[p], math.log(quietest) + 0.5 * sd[p])
    return centre, covariance, tuple(humps)


def _closed_form(regression: LawRegression, positive: Mask, prior: ForcePrior, n: int, theta: Array) -> float:
    """Log density of the closed form at one point, up to what all points share.

    The evidence of the place times the conjugate posterior given it, a normal-inverse-gamma, cut where a
    coefficient has to be positive; the mass that is cut off cancels in the product, so that ``regression``
    has coefficients of either sign. Where the noise is at the least that the sensor allows, the evidence has
    it there and is not its average.
    """
    at = _Coordinates.of(theta[None], regression.scale)
    scaled, log_v = at.scaled[0], float(at.log_variance[0])
    if np.any(scaled[positive] < 0.0):
        return -math.inf
    u, log_tau = at.places[0]
    ratio, tau = _force(u, log_tau)
    whitened = regression.whiten_at(ratio, tau)
    free = Problem.of(regression).weigh(ratio, tau)
    lam, rest = free.full_noise2, n * free.noise2[0]
    precision = whitened.gram[:-1, :-1] + lam * np.eye(scaled.size)
    mean, _ = set_posterior(
        whitened.gram, regression.reference, regression.sets[0], lam, float(free.noise2[0])
    )
    away = scaled - mean
    log_density = 0.5 * np.linalg.slogdet(precision)[1] - 0.5 * scaled.size * log_v
    log_density -= 0.5 * math.exp(-log_v) * (away @ precision @ away + rest)
    log_density += 0.5 * n * (math.log(0.5 * rest) - log_v)
    return float(log_density) + _log_weight(free, prior, u, log_tau)
