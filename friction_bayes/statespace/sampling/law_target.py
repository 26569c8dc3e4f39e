r"""The posterior of a law on one or several records as a sampler sees it: every shared parameter free.

.. math:: y_r \sim N(S_r b + O_r a_r,\, \sigma^2 n_r^2 V_r(q/\sigma, \tau)), \quad b_j \sim N(0, s_j^2),
          \quad p(\sigma) \propto 1/\sigma, \quad \log q \sim N, \quad \log\tau \sim U

with ``b`` shared by all records, ``s`` its prior sd, half-normal where a coefficient has to be positive, and
the prior of ``q`` and ``tau`` that of :class:`friction_bayes.statespace.force_prior.ForcePrior`, or no random
force. Coefficients ``a`` of a record's own, if any, are integrated out as in
:mod:`friction_bayes.statespace.problem`, with a prior in units of the noise. Likelihood and Gram matrices are
those of the closed form, whose other approximations are not used here, so that a sampler checks them: the
prior precision of ``b`` in units of the noise found with all columns, the prior of ``q`` at the noise found
given ``q/sigma`` and ``tau``, normals for Student t distributions of hundreds of degrees of freedom, the
grid, and the moments of ``q`` and ``tau``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.force_grid import valleys
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint, at_resonance
from friction_bayes.statespace.kalman import shown
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.sampling.interpolated_sums import InterpolatedSums
from friction_bayes.statespace.sampling.replication import drawn_fluctuation, drawn_noise
from friction_bayes.statespace.subset_evidence import SetEvidences, set_posterior

__all__ = ["half_cycle_blocks", "law_target"]

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


def law_target(
    problem: Problem,
    prior: ForcePrior | None,
    *,
    natural: Callable[[Array, Array, Array, Array], dict[str, Array]],
    signals: Sequence[Array],
    unit: float,
) -> Target:
    """Build the target of a law, given that there is a random force or none.

    Parameters
    ----------
    problem : Problem
        The records on one set of columns, see :meth:`Problem.only`.
    prior : ForcePrior or None
        Of the random force; None for none.
    natural : callable, (shared coefficients (m, s), noise sd (m,), q (m,), tau (m,)) -> dict
        Natural parameters of draws, from those in natural units; ``q`` is zero without a random force.
    signals : sequence of ndarray, length r
        The records in their own unit.
    unit : float
        Natural unit in the unit of the signal.

    Returns
    -------
    Target
        Coordinates: the shared coefficients, ``log_variance`` of the sensor noise and, of a random force,
        ``log_force_sd`` and ``log_correlation_time``, natural units. ``pointwise`` is the density of each
        half cycle of each record given those before it: under a random force half cycles are not independent
        given the parameters.
    """
    sampled = _Sampled(problem, prior, natural, tuple(signals), unit)
    centre, covariance, humps = sampled.moments
    force = () if prior is None else ("log_force_sd", "log_correlation_time")
    return Target(
        names=(*(problem.names[j] for j in problem.shared), "log_variance", *force),
        log_prob=sampled.log_prob,
        closed_form=sampled.closed_form,
        centre=centre,
        covariance=covariance,
        posterior=sampled.posterior,
        log_prior=sampled.log_prior,
        pointwise=sampled.pointwise,
        predictive=sampled.predictive,
        prior_draws=_no_prior_draws,
        observed=np.concatenate(signals),
        observed_name="signal",
        humps=humps,
    )


@dataclass(frozen=True, eq=False)
class _Coordinates:
    """Columns of a sampler's coordinates by name; without a random force its size is zero."""

    laws: Array
    log_variance: Array
    force_sd: Array
    tau: Array

    @classmethod
    def of(cls, theta: Array, *, forced: bool) -> _Coordinates:
        if forced:
            return cls(theta[:, :-3], theta[:, -3], np.exp(theta[:, -2]), np.exp(theta[:, -1]))
        none = np.zeros(len(theta))
        return cls(theta[:, :-1], theta[:, -1], none, none + _NO_FORCE[1])

    @property
    def noise(self) -> Array:
        return np.asarray(np.exp(0.5 * self.log_variance))

    @property
    def places(self) -> Array:
        """``(u, l)``, shape (m, 2)."""
        log_ratio = np.log(self.force_sd) - 0.5 * self.log_variance
        return np.column_stack([log_ratio + np.log(at_resonance(self.tau)), np.log(self.tau)])


@dataclass(frozen=True, eq=False)
class _Sampled:
    """The posterior at a sampler's coordinates; fields are the parameters of :func:`law_target`."""

    problem: Problem
    prior: ForcePrior | None
    natural: Callable[[Array, Array, Array, Array], dict[str, Array]]
    signals: tuple[Array, ...]
    unit: float

    def _coordinates(self, theta: Array) -> _Coordinates:
        return _Coordinates.of(theta, forced=self.prior is not None)

    @cached_property
    def _scale(self) -> Array:
        return self.problem.scale[self.problem.shared]

    @cached_property
    def _sums(self) -> InterpolatedSums:
        """Whitened sums of the records over the places of the random force."""
        return InterpolatedSums.over(
            self._axes, lambda u, log_tau: self.problem.marginal(*_force(u, log_tau))
        )

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        assert self.prior is not None
        return _axes(self.problem, self.prior)

    @cached_property
    def _still(self) -> tuple[Array, Array]:
        """The same sums without a random force."""
        found = self.problem.marginal(*_NO_FORCE)
        factor = np.asarray(np.linalg.cholesky(found.gram), dtype=np.float64)
        return factor.T[None], np.array([found.log_determinant])

    @cached_property
    def _uncut(self) -> Problem:
        return self.problem.of_either_sign()

    @cached_property
    def moments(self) -> tuple[Array, Array, tuple[tuple[Array, Array], ...]]:
        """Mean and covariance of the closed form in the sampler's coordinates, and those of its modes."""
        if self.prior is None:
            centre, covariance = _moments_without_force(self.problem)
            return centre, covariance, ()
        return _moments(self.problem, self.prior, self._axes, self._sums)

    def log_prior(self, theta: Array) -> Array:
        at = self._coordinates(theta)
        law = self.problem.log_prior_density(at.laws / self._scale)
        if self.prior is not None:
            law = law + self.prior.log_density(at.force_sd, at.tau)
        log_v = at.log_variance
        audible = (log_v >= self.problem.log_least_variance) & (np.abs(log_v) < _LOG_LIMIT)
        return np.where(audible, law, -np.inf)

    def log_prob(self, theta: Array) -> Array:
        out = self.log_prior(theta)
        if self.prior is not None:
            # nothing is sampled beyond the grid of the sums
            out[~self._sums.inside(self._coordinates(theta).places)] = -np.inf
        use = np.flatnonzero(np.isfinite(out))
        if use.size:
            at = self._coordinates(theta[use])
            factors, log_determinant = self._still if self.prior is None else self._sums.at(at.places)
            misfit = _misfit(factors, self.problem.reference - at.laws / self._scale)
            likelihood = signal_log_likelihood(misfit, at.log_variance, self.problem.used)
            out[use] += likelihood - 0.5 * log_determinant
        return out

    def closed_form(self, theta: Array) -> Array:
        positive = self.problem.positive[self.problem.shared]
        at = self._coordinates(theta)
        found = np.full(len(theta), -math.inf)
        for i in np.flatnonzero(((at.laws >= 0.0) | ~positive).all(axis=1)):
            ratio = float(at.force_sd[i] / at.noise[i])
            found[i] = self._closed_form(
                at.laws[i] / self._scale, float(at.log_variance[i]), ratio, float(at.tau[i])
            )
        return found

    def _closed_form(self, scaled: Array, log_v: float, ratio: float, tau: float) -> float:
        """Log density of the closed form at one point, up to what all points share.

        The evidence of the place times the conjugate posterior given it, a normal-inverse-gamma, cut where a
        coefficient has to be positive; the mass that is cut off cancels in the product, so that coefficients
        of either sign are integrated. Where the noise is at the least that the sensor allows, the evidence
        has it there and is not its average.
        """
        problem, n = self._uncut, self.problem.used
        found, whitened = problem.evaluate(ratio, tau), problem.marginal(ratio, tau)
        lam, rest, every = found.full_noise2, n * float(found.noise2[0]), np.ones(scaled.size, np.bool_)
        precision = whitened.gram[:-1, :-1] + lam * np.eye(scaled.size)
        mean, _ = set_posterior(whitened.gram, problem.reference, every, lam, float(found.noise2[0]))
        away = scaled - mean
        value = 0.5 * np.linalg.slogdet(precision)[1] - 0.5 * scaled.size * log_v
        value -= 0.5 * math.exp(-log_v) * (away @ precision @ away + rest)
        value += 0.5 * n * (math.log(0.5 * rest) - log_v)
        if self.prior is None:
            return float(value + found.log_weight[0])
        return float(value) + _log_weight(found, self.prior, ratio, tau)

    def posterior(self, theta: Array) -> dict[str, Array]:
        at = self._coordinates(theta)
        return self.natural(at.laws, at.noise, at.force_sd, at.tau)

    def pointwise(self, theta: Array) -> Array:
        at, rows = self._coordinates(theta), []
        # of a record's own coefficients one draw each, the same at the same coordinates
        rng = np.random.default_rng(0)
        for law, noise, q, tau in zip(at.laws, at.noise, at.force_sd, at.tau, strict=True):
            densities = []
            for member, own in zip(
                self.problem.members, self._laws(law, noise, q / noise, tau, rng), strict=True
            ):
                regression = member.regression
                each = regression.log_densities(
                    own, (noise * member.noise) ** 2, member.ratio(q / noise), tau
                )
                densities.append(np.add.reduceat(each, half_cycle_blocks(regression.clock.phase)))
            rows.append(np.concatenate(densities))
        return np.array(rows)

    def predictive(self, theta: Array, rng: np.random.Generator) -> Array:
        at, rows = self._coordinates(theta), []
        for law, noise, q, tau in zip(at.laws, at.noise, at.force_sd, at.tau, strict=True):
            again = []
            laws = self._laws(law, noise, q / noise, tau, rng)
            for member, own, signal in zip(self.problem.members, laws, self.signals, strict=True):
                regression = member.regression
                drawn = noise * member.noise * drawn_noise(regression.clock, rng)
                if self.prior is not None:
                    fluctuation = drawn_fluctuation(regression.clock, tau, rng)
                    drawn += q * member.force * shown(fluctuation, regression.row)
                again.append(signal + self.unit * (drawn - regression.residual(own)))
            rows.append(np.concatenate(again))
        return np.array(rows)

    def _laws(self, law: Array, noise: float, ratio: float, tau: float, rng: np.random.Generator) -> Array:
        """Coefficients of each record, shape (r, p), its own drawn given all else."""
        problem = self.problem
        if problem.all_shared:
            return np.tile(law, (len(problem.members), 1))
        lam = problem.evaluate(ratio, tau).full_noise2
        found = SetEvidences(np.zeros(1), np.array([noise**2]), lam)
        point = GridPoint(ratio=ratio, tau=tau, log_volume=0.0, found=found)
        return problem.conditional(point, 0).laws(law[None], rng)[0]


def half_cycle_blocks(phase: Array) -> Integers:
    """First sample of each half cycle of a clock, shape (n,); what is left over goes with the last."""
    half_cycles = (phase - phase[0]) / math.pi
    starts = np.searchsorted(half_cycles, np.arange(max(int(half_cycles[-1]), 1)))
    return np.asarray(np.unique(starts), dtype=np.int64)


def _no_prior_draws(rng: np.random.Generator, count: int) -> Array:
    """Refuse to draw from a prior under which every size of the noise is as probable as any other."""
    raise InputError("prior", "that of the noise is improper", "draw from a proper prior")


def _force(u: float, log_tau: float) -> tuple[float, float]:
    """``q / sigma`` and ``tau`` of a place."""
    tau = math.exp(log_tau)
    return math.exp(u) / float(at_resonance(tau)), tau


def _misfit(factors: Array, rest: Array) -> Array:
    """Whitened sums of squares, shape (m,), of ``y - X b`` with ``rest`` = reference - b, shape (m, p)."""
    whitened = (factors[:, :, :-1] @ rest[:, :, None])[:, :, 0] + factors[:, :, -1]
    return np.asarray((whitened**2).sum(axis=1))


def _axes(problem: Problem, prior: ForcePrior) -> tuple[Array, Array]:
    """Axes of the smallest rectangle of ``(u, l)`` that contains the posterior except a negligible part."""
    tau = np.exp(np.linspace(math.log(prior.tau_low), math.log(prior.tau_high), 12))
    middle = math.log(prior.centre / problem.noise_before)
    reach = _REACH * prior.spread
    steps = math.ceil(2.0 * reach / _COARSE)
    u = np.linspace(middle - reach + math.log(np.min(at_resonance(tau))), middle + reach, steps)
    value = np.empty((u.size, tau.size))
    for i, j in np.ndindex(*value.shape):
        force = _force(float(u[i]), math.log(tau[j]))
        value[i, j] = _log_weight(problem.evaluate(*force), prior, *force)
    near = np.argwhere(value > value.max() - _DEPTH)
    low, high = np.maximum(near.min(axis=0) - 1, 0), near.max(axis=0) + 1
    ends = [
        (axis[a], axis[min(b, axis.size - 1)]) for axis, a, b in zip((u, np.log(tau)), low, high, strict=True)
    ]
    first, second = (np.linspace(*end, steps + 1) for end, steps in zip(ends, _FINE, strict=True))
    return first, second


def _log_weight(found: SetEvidences, prior: ForcePrior, ratio: float, tau: float) -> float:
    """Log evidence of a place times the prior there, at the noise found there."""
    q = ratio * math.sqrt(found.noise2[0])
    # the ends of the range of tau belong to it, whichever way they round
    within = min(max(tau, prior.tau_low), prior.tau_high)
    tau = within if math.isclose(tau, within, rel_tol=1e-9) else tau
    return float(found.log_weight[0] + prior.log_density(q, tau))


def _moments_without_force(problem: Problem) -> tuple[Array, Array]:
    """Mean and covariance of the closed form in the sampler's coordinates, without a random force."""
    scale, n = problem.scale[problem.shared], problem.used
    found, whitened = problem.evaluate(*_NO_FORCE), problem.marginal(*_NO_FORCE)
    noise2, every = float(found.noise2[0]), np.ones(scale.size, np.bool_)
    mean, own = set_posterior(whitened.gram, problem.reference, every, found.full_noise2, noise2)
    covariance = np.zeros((scale.size + 1, scale.size + 1))
    covariance[:-1, :-1] = own * np.outer(scale, scale)
    covariance[-1, -1] = 2.0 / n
    return _inside_support(np.append(mean * scale, math.log(noise2)), covariance, problem), covariance


def _inside_support(centre: Array, covariance: Array, problem: Problem) -> Array:
    """The centre moved inside the support, where a sampler has to start."""
    sd, p = np.sqrt(np.diag(covariance)), problem.shared.size
    positive = problem.positive[problem.shared]
    centre[:p] = np.where(positive, np.maximum(centre[:p], 0.5 * sd[:p]), centre[:p])
    centre[p] = max(centre[p], problem.log_least_variance + 0.5 * sd[p])
    return centre


def _moments(
    problem: Problem, prior: ForcePrior, axes: tuple[Array, Array], sums: InterpolatedSums
) -> tuple[Array, Array, tuple[tuple[Array, Array], ...]]:
    """Mean and covariance of the closed form in the sampler's coordinates, by sums over the grid.

    And of each of its modes, where there are several: the correlation times between two valleys.
    """
    scale, n, quietest = problem.scale[problem.shared], problem.used, problem.least_noise2
    p = scale.size
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    factors, log_determinant = sums.at(places)
    upper, right, least = factors[:, :p, :p], factors[:, :p, p], factors[:, p, p] ** 2
    lam = np.maximum(least / max(n - p, 1), quietest)
    precision = upper.mT @ upper + lam[:, None, None] * np.eye(p)
    inverse = np.linalg.inv(precision)
    change = (upper.mT @ right[:, :, None])[:, :, 0] - lam[:, None] * problem.reference
    moved = (inverse @ change[:, :, None])[:, :, 0]
    mean = problem.reference + moved
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
    return _inside_support(centre, covariance, problem), covariance, tuple(humps)
