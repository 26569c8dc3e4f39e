"""Draws from the posterior of several records under one law."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.random_force.draws import LEAST_PROBABILITY, LawDraws, laws_drawn, unit_force
from friction_bayes.loop.random_force.joint_fit import SPREADS, JointFit
from friction_bayes.loop.truncated_normal import truncated_draws

__all__ = ["JointDraws", "joint_draws"]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointDraws:
    """Joint draws of the law, of what each record has of its own, and of the spread between them.

    Attributes
    ----------
    records : tuple of LawDraws, length r
        Those of each record, of its own friction.
    friction : ndarray, shape (k,)
        Mean friction [N or N m]: that of all records where it does not differ between them.
    spread : ndarray, shape (k,)
        Spread of friction between records [N or N m]; zero where it does not differ.
    """

    records: tuple[LawDraws, ...]
    friction: Array
    spread: Array

    @property
    def sets(self) -> Integers:
        """Set of effects of each draw, shape (k,)."""
        return self.records[0].chosen

    def parameters(self, effect: str, chosen: Mask) -> dict[str, Array]:
        """Parameters of an effect in the ``chosen`` draws that have it, a record's own with its number."""
        columns = self.records[0].fit.law.columns
        if not any(column.own for column in columns if column.effect == effect):
            # a share of friction is one of the mean friction
            return replace(self.records[0], friction=self.friction).parameters(effect, chosen)
        return {
            f"{name}[{r}]": values
            for r, draws in enumerate(self.records)
            for name, values in draws.parameters(effect, chosen).items()
        }


def joint_draws(fit: JointFit, rng: np.random.Generator, draws: int) -> JointDraws:
    """Draw from each set at each point of the grid and each spread in proportion to its probability."""
    posterior, problem = fit.posterior, fit.problem
    weight = np.where(posterior.weight > LEAST_PROBABILITY, posterior.weight, 0.0)
    counts = rng.multinomial(draws, (weight / weight.sum()).ravel())
    laws = np.zeros((draws, len(fit.records), problem.own.size))
    mean = np.zeros((draws, problem.own.size))
    point, row, noise = np.zeros(draws, np.intp), np.zeros(draws, np.intp), np.zeros(draws)
    at = 0
    for flat in np.flatnonzero(counts):
        g, m = divmod(int(flat), weight.shape[1])
        k = int(counts[flat])
        here = slice(at, at + k)
        said = problem.conditional(posterior.points[g], m)
        low = np.where(problem.positive[said.columns], 0.0, -np.inf)
        high = np.full(said.columns.size, np.inf)
        shared = truncated_draws(said.mean, said.covariance, low, high, rng, k)
        mean[here, said.columns] = shared
        laws[here] = said.laws(shared, rng)
        point[here], row[here], noise[here] = g, m, said.noise
        at += k
    chosen = problem.number[row]
    records = tuple(
        laws_drawn(
            one,
            laws[:, r],
            point=point,
            chosen=chosen,
            ratio=posterior.ratio[point] * member.force / member.noise,
            tau=posterior.tau[point],
            noise=noise * member.noise,
            rng=rng,
        )
        for r, (one, member) in enumerate(zip(fit.fits, problem.members, strict=True))
    )
    frictions = fit.along[0].law.frictions
    force = unit_force(fit.fits[0], records[0].stiffness)
    # a spread stands for its part of the prior
    step = SPREADS[1] / SPREADS[0]
    spread = fit.level * fit.spread_of[row] * step ** rng.uniform(-0.5, 0.5, draws)
    return JointDraws(records=records, friction=mean[:, frictions].sum(axis=1) * force, spread=spread * force)
