r"""The posterior of several records under one law as a sampler sees it: every shared parameter free.

.. math:: y_r \sim N(S_r b + O_r a_r,\, \sigma^2 n_r^2 V_r(q/\sigma, \tau)), \quad b, a_r \sim N(0, s^2),
          \quad p(\sigma) \propto 1/\sigma, \quad \log q \sim N, \quad \log\tau \sim U

with ``b`` shared by all records, half-normal where it has to be positive, and ``a`` each record's own, the
deviation of its friction among them: normal, and integrated out exactly at every size of the noise. The
ratios of noise and random force between records are those of :class:`.joint_problem.Member`. The closed form
has the prior precision in units of the noise found with all columns, and a grid over the random force.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from friction_bayes.conjugate.likelihood import Target, signal_log_likelihood
from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.statespace.force_grid import Posterior
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint, at_resonance
from friction_bayes.statespace.force_target import no_prior_draws
from friction_bayes.statespace.interpolated_sums import InterpolatedSums
from friction_bayes.statespace.kalman import shown
from friction_bayes.statespace.problem import Member, Problem, Spread
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.replication import drawn_fluctuation, drawn_noise

__all__ = ["JointTarget"]

_BEYOND = 0.75
"""Of the grid's extent, on either side of it, that is sampled too: it ends some three sd from its middle."""
_FINE = (28, 20)
"""Steps of the interpolation in ``u`` and in ``log tau``."""
_LOG_LIMIT = 300.0


@dataclass(frozen=True, kw_only=True, eq=False)
class JointTarget:
    """One set of columns of several records, with a spread of friction or none, under a random force or none.

    Attributes
    ----------
    problem : Problem
    posterior : Posterior
        Of the problem.
    row : int
        Which of the problem's sets.
    prior : ForcePrior
        Of the random force.
    forced : bool
        Whether there is a random force.
    """

    problem: Problem
    posterior: Posterior
    row: int
    prior: ForcePrior
    forced: bool

    @property
    def names(self) -> tuple[str, ...]:
        """Of the coordinates: shared coefficients, ``log_variance`` and, of a random force, two more."""
        force = ("log_force_sd", "log_correlation_time") if self.forced else ()
        return (*(self.problem.names[j] for j in self.shared), "log_variance", *force)

    @cached_property
    def shared(self) -> Integers:
        """The shared columns of the set."""
        return np.flatnonzero(self.problem.sets[self.row])

    def target(
        self, *, natural: Callable[[Array], dict[str, Array]], signals: list[Array], unit: float
    ) -> Target:
        """Parameters that are sampled.

        Parameters
        ----------
        natural : callable, coefficients (m, p) of all the problem's columns -> dict
            Natural parameters of draws.
        signals : list of ndarray, length r
            The records in their own unit.
        unit : float
            Natural unit in the unit of the signal.

        Returns
        -------
        Target
            ``pointwise`` has one density a record, given the parameters alone: so given, records are
            independent.
        """
        centre, covariance = self._moments()

        def log_prob(theta: Array) -> Array:
            out = self.log_prior(theta)
            use = np.flatnonzero(np.isfinite(out))
            if use.size:
                out[use] += self.each_record(theta[use]).sum(axis=1)
            return out

        def posterior(theta: Array) -> dict[str, Array]:
            laws = np.zeros((len(theta), self.problem.own.size))
            laws[:, self.shared] = theta[:, : self.shared.size]
            return natural(laws)

        def predictive(theta: Array, rng: np.random.Generator) -> Array:
            return np.array([np.concatenate(self._replicated(row, signals, unit, rng)) for row in theta])

        return Target(
            names=self.names,
            log_prob=log_prob,
            closed_form=lambda theta: np.array([self._closed_form(row) for row in theta]),
            centre=centre,
            covariance=covariance,
            posterior=posterior,
            log_prior=self.log_prior,
            pointwise=self.each_record,
            predictive=predictive,
            prior_draws=no_prior_draws,
            observed=np.concatenate(signals),
            observed_name="signal",
        )

    def log_prior(self, theta: Array) -> Array:
        """Log prior density of shared coefficients, noise and random force, shape (m,)."""
        s, log_v = self.shared.size, theta[:, self.shared.size]
        scaled = theta[:, :s] / self.problem.scale[self.shared]
        regression = self.problem.members[0].regression.of_columns(self.problem.sets[self.row])
        audible = (log_v >= self._log_least_variance) & (np.abs(log_v) < _LOG_LIMIT)
        value = np.where(audible, regression.log_prior_density(scaled), -np.inf)
        if self.forced:
            within = self._sums[0].inside(self._places(theta))
            force = self.prior.log_density(np.exp(theta[:, s + 1]), np.exp(theta[:, s + 2]))
            value = value + np.where(within, force, -np.inf)
        return np.asarray(value)

    def each_record(self, theta: Array) -> Array:
        """Log-likelihood of each record, its own coefficients integrated out, shape (m, r)."""
        return np.stack([self._of_record(theta, r)[0] for r in range(len(self._records))], axis=1)

    @cached_property
    def _chosen(self) -> Mask:
        """Columns of the set, own and shared."""
        return self.problem.inside(self.row) | self.problem.sets[self.row]

    @cached_property
    def _records(self) -> tuple[LawRegression, ...]:
        return tuple(member.regression.of_columns(self._chosen) for member in self.problem.members)

    @cached_property
    def _deviation(self) -> tuple[int, float] | None:
        """Which of the chosen columns differs between the records, and its prior sd; None where none does."""
        column, sd = self.problem.deviation(self.row)
        return None if column < 0 else (int(np.count_nonzero(self._chosen[:column])), sd)

    @cached_property
    def _used(self) -> int:
        return sum(_samples(regression) for regression in self._records)

    @cached_property
    def _log_least_variance(self) -> float:
        members = self.problem.members
        return max(m.regression.log_least_variance - 2.0 * math.log(m.noise) for m in members)

    @cached_property
    def _sums(self) -> tuple[InterpolatedSums, ...]:
        """Sums of each record over the places (u, log tau) of the common random force."""
        u, log_tau = (self._axis(values, steps) for values, steps in zip(self._grid.T, _FINE, strict=True))
        low, high = math.log(self.prior.tau_low), math.log(self.prior.tau_high)
        log_tau = np.linspace(max(log_tau[0], low), min(log_tau[-1], high), log_tau.size)

        def of(member: Member, regression: LawRegression) -> InterpolatedSums:
            return InterpolatedSums.over(
                (u, log_tau),
                lambda place, at: regression.whiten_at(
                    member.ratio(math.exp(place) / float(at_resonance(math.exp(at)))), math.exp(at)
                ),
            )

        return tuple(of(*pair) for pair in zip(self.problem.members, self._records, strict=True))

    @cached_property
    def _grid(self) -> Array:
        """Places of the closed form's points with a random force, shape (g, 2)."""
        forced = self.posterior.ratio > 0.0
        ratio, tau = self.posterior.ratio[forced], self.posterior.tau[forced]
        return np.column_stack([np.log(ratio * at_resonance(tau)), np.log(tau)])

    @staticmethod
    def _axis(values: Array, steps: int) -> Array:
        margin = _BEYOND * np.ptp(values)
        return np.linspace(values.min() - margin, values.max() + margin, steps + 1)

    def _places(self, theta: Array) -> Array:
        """``(u, log tau)`` of the sampler's coordinates, shape (m, 2)."""
        log_v, log_q, log_tau = theta[:, -3:].T
        return np.column_stack([log_q - 0.5 * log_v + np.log(at_resonance(np.exp(log_tau))), log_tau])

    def _factors(self, theta: Array, r: int) -> tuple[Array, Array]:
        """Whitened columns of a record, reduced to (m, p + 1, p + 1), and log determinants, (m,)."""
        if self.forced:
            return self._sums[r].at(self._places(theta))
        found = self._records[r].whiten_at(0.0, 1.0)
        ridge = 1e-13 * np.diag(np.diag(found.gram))
        factor = np.linalg.cholesky(found.gram + ridge).T
        return np.tile(factor, (len(theta), 1, 1)), np.full(len(theta), found.log_determinant)

    def _of_record(self, theta: Array, r: int, scores: Array | None = None) -> tuple[Array, Array]:
        """Log-likelihood (m,) of a record, and its own coefficients (m, k) about their reference.

        These are means, or draws with normal ``scores`` (m, k); a deviation of friction is the last.
        """
        member, regression = self.problem.members[r], self._records[r]
        factors, log_determinant = self._factors(theta, r)
        factors = factors / member.noise
        s = self.shared.size
        variance = np.exp(theta[:, s])
        own, deviation = self.problem.own[self._chosen], self._deviation
        at_shared = np.flatnonzero(~own)
        away = regression.reference[at_shared] - theta[:, :s] / self.problem.scale[self.shared]
        rest = factors[:, :, -1] + (factors[:, :, at_shared] @ away[:, :, None])[:, :, 0]
        columns, centre = factors[:, :, np.flatnonzero(own)], regression.reference[own]
        if deviation is not None:
            place, sd = deviation
            columns = np.concatenate([columns, sd * factors[:, :, place, None]], axis=2)
            centre = np.append(centre, 0.0)
        k = centre.size
        precision = columns.mT @ columns + variance[:, None, None] * np.eye(k)
        right = (columns.mT @ rest[:, :, None])[:, :, 0] - variance[:, None] * centre
        mine = np.linalg.solve(precision, right[:, :, None])[:, :, 0]
        misfit = ((rest - (columns @ mine[:, :, None])[:, :, 0]) ** 2).sum(axis=1)
        misfit += variance * ((centre + mine) ** 2).sum(axis=1)
        used = _samples(regression)
        value = signal_log_likelihood(misfit, theta[:, s], used) - used * math.log(member.noise)
        value -= 0.5 * (log_determinant + np.linalg.slogdet(precision)[1] - k * theta[:, s])
        if scores is not None:
            root = np.linalg.cholesky(precision).mT
            drawn = np.linalg.solve(root, scores[:, :, None])[:, :, 0]
            mine = mine + np.sqrt(variance)[:, None] * drawn
        return value, np.asarray(mine)

    def _replicated(
        self, row: Array, signals: list[Array], unit: float, rng: np.random.Generator
    ) -> list[Array]:
        """Every record anew under one draw of the parameters."""
        s, noise = self.shared.size, math.exp(0.5 * row[self.shared.size])
        own, deviation = self.problem.own[self._chosen], self._deviation
        k, found = int(own.sum()), []
        for r, (member, regression) in enumerate(zip(self.problem.members, self._records, strict=True)):
            scores = rng.standard_normal((1, k + (deviation is not None)))
            mine = self._of_record(row[None], r, scores)[1][0]
            law = np.zeros(own.size)
            law[own] = (regression.reference[own] + mine[:k]) * regression.scale[own]
            law[~own] = row[:s]
            if deviation is not None:
                place, sd = deviation
                law[place] += sd * mine[-1] * regression.scale[place]
            drawn = member.noise * noise * drawn_noise(regression.clock, rng)
            if self.forced:
                fluctuation = drawn_fluctuation(regression.clock, math.exp(row[-1]), rng)
                drawn += member.force * math.exp(row[-2]) * shown(fluctuation, regression.row)
            found.append(signals[r] + unit * (drawn - regression.residual(law)))
        return found

    def _moments(self) -> tuple[Array, Array]:
        """Mean and covariance of the closed form in the sampler's coordinates."""
        mine = (self.posterior.ratio > 0.0) == self.forced
        weight = np.where(mine, self.posterior.weight[:, self.row], 0.0)
        weight /= weight.sum()
        s = self.shared.size
        covariance = np.zeros((len(self.names), len(self.names)))
        each = []
        for g in np.flatnonzero(mine):
            point = self.posterior.points[g]
            said = self.problem.conditional(point, self.row)
            force = [math.log(point.ratio * said.noise), math.log(point.tau)] if self.forced else []
            each.append(np.array([*said.mean, 2.0 * math.log(said.noise), *force]))
            covariance[:s, :s] += weight[g] * said.covariance
        away = np.array(each) - weight[mine] @ np.array(each)
        covariance += (weight[mine, None] * away).T @ away
        # the noise variance given the place, and the force's sd with it
        both = np.array([[2.0, 1.0], [1.0, 0.5]]) / self._used
        mixed = 1 + self.forced
        covariance[s : s + mixed, s : s + mixed] += both[:mixed, :mixed]
        centre, sd = weight[mine] @ np.array(each), np.sqrt(np.diag(covariance))
        # the sampler has to start inside the support
        positive = self.problem.positive[self.shared]
        centre[:s] = np.where(positive, np.maximum(centre[:s], 0.5 * sd[:s]), centre[:s])
        centre[s] = max(centre[s], self._log_least_variance + 0.5 * sd[s])
        return centre, covariance

    def _closed_form(self, theta: Array) -> float:
        """Log density of the closed form at one point, up to what all points share.

        The evidence of the place times the conjugate posterior given it, as for one record.
        """
        s = self.shared.size
        scaled, log_v = theta[:s] / self.problem.scale[self.shared], float(theta[s])
        if np.any(scaled[self.problem.positive[self.shared]] < 0.0):
            return -math.inf
        ratio, tau = 0.0, 1.0
        if self.forced:
            ratio, tau = math.exp(theta[s + 1] - 0.5 * log_v), math.exp(theta[s + 2])
        free = self._uncut
        found = free.weigh(ratio, tau)
        noise2, used = float(found.noise2[0]), self._used
        point = GridPoint(ratio=ratio, tau=tau, log_volume=0.0, found=found)
        mean, covariance = free.shared_posterior(point, 0, free.sets[0])
        precision = noise2 * np.linalg.inv(covariance)
        rest, away = used * noise2, scaled - mean
        value = float(found.log_weight[0]) + 0.5 * np.linalg.slogdet(precision)[1] - 0.5 * s * log_v
        value -= 0.5 * math.exp(-log_v) * (away @ precision @ away + rest)
        value += 0.5 * used * (math.log(0.5 * rest) - log_v)
        force = self.prior.log_density(ratio * math.sqrt(noise2), tau) if self.forced else 0.0
        return float(value + force)

    @cached_property
    def _uncut(self) -> Problem:
        """The set alone, its coefficients of either sign: the truncated mass cancels in the product."""
        members = [
            replace(
                member,
                regression=replace(regression, positive=np.zeros_like(regression.positive)),
            )
            for member, regression in zip(self.problem.members, self._records, strict=True)
        ]
        place, sd = (-1, 0.0) if self._deviation is None else self._deviation
        spread = Spread(columns=np.array([place]), sd=np.array([sd]), log_prior=np.zeros(1))
        return Problem(members, self.problem.own[self._chosen], spread)


def _samples(regression: LawRegression) -> int:
    return int(np.count_nonzero(np.isfinite(regression.clock.variance)))
