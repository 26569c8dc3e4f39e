"""Draws of the law that one or several records share, and of each record's own parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.infer.draws import shared_out
from friction_bayes.loop.infer.law_draws import LawDraws, laws_drawn, unit_force
from friction_bayes.loop.infer.law_fit import LawFit, spreads_weighed
from friction_bayes.loop.infer.truncated_normal import truncated_draws
from friction_bayes.mechanics.effects import EFFECTS, GrowingNoiseEffect
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = ["LEAST_PROBABILITY", "DrawnLaws", "draw_laws"]

LEAST_PROBABILITY = 1e-4
"""Probability of a set at a point of the grid below which nothing is drawn from it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnLaws:
    """Joint draws of the law, of each record's own parameters, and of the spread between records.

    Attributes
    ----------
    records : tuple of LawDraws, length r
        Those of each record, of its own friction.
    row : ndarray of int, shape (k,)
        Which of the posterior's sets each draw has.
    friction : ndarray, shape (k,)
        Mean friction [N or N m]: that of all records where it does not differ between them.
    spread : ndarray, shape (k,)
        Spread of friction between records [N or N m]; zero where it does not differ.
    """

    records: tuple[LawDraws, ...]
    row: Integers
    friction: Array
    spread: Array

    @property
    def first(self) -> LawDraws:
        """Those of the first record."""
        return self.records[0]

    @property
    def of_first(self) -> DrawnLaws:
        """The same as if the first record were the only one."""
        return replace(self, records=self.records[:1], friction=self.first.friction)

    @property
    def frequency(self) -> Array:
        """Natural frequency [rad/s], shape (k,)."""
        return np.asarray(self.first.fit.w0 * np.sqrt(np.maximum(1.0 + self.first.stiffness, 0.25)))

    @property
    def scores(self) -> Array:
        """Coefficients of effects in units of their prior sd, shape (k, c); zero where a law lacks one.

        Each record's own are counted in addition to the shared ones.
        """
        own = np.array([column.own for column in self.first.fit.law.columns])
        return np.hstack([_scores(self.first, ~own), *(_scores(draws, own) for draws in self.records)])

    def parameters(self, effect: str, chosen: Mask) -> dict[str, Array]:
        """Parameters of an effect in the ``chosen`` draws that have it, a record's own with its number."""
        if isinstance(EFFECTS[effect], GrowingNoiseEffect):
            return {EFFECTS[effect].parameters[0].name: self.first.noise_growth[chosen]}
        if effect == RANDOM_FORCE.name:
            return {
                "sd": self.first.random_force[chosen],
                "correlation_time": self.first.correlation_time[chosen],
            }
        own = any(column.own for column in self.first.fit.law.columns if column.effect == effect)
        if len(self.records) == 1 or not own:
            # a share of friction is one of the mean friction
            return _parameters(replace(self.first, friction=self.friction), effect, chosen)
        return {
            f"{name}[{r}]": values
            for r, draws in enumerate(self.records)
            for name, values in _parameters(draws, effect, chosen).items()
        }


def draw_laws(fit: LawFit, rng: np.random.Generator, draws: int, weight: Array | None = None) -> DrawnLaws:
    """Draws from each set at each point of the grid and each spread in proportion to its probability.

    Another ``weight`` than the posterior's may be given, shape (points, sets).
    """
    posterior, problem = fit.posterior, fit.problem
    weight = posterior.weight if weight is None else weight / weight.sum()
    weight = np.where(weight > LEAST_PROBABILITY, weight, 0.0)
    counts = shared_out(draws, weight.ravel(), rng)
    laws = np.zeros((draws, len(fit.fits), problem.own.size))
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
            ratio=posterior.ratio[point] * member.ratio(1.0),
            tau=posterior.tau[point],
            noise=noise * member.noise,
            rng=rng,
        )
        for r, (one, member) in enumerate(zip(fit.fits, problem.members, strict=True))
    )
    frictions = fit.law.frictions
    force = unit_force(fit.fits[0], records[0].stiffness)
    spread = fit.level * fit.spread_of[row]
    if not fit.one:
        # a spread represents its part of the prior
        least, second = spreads_weighed()[:2]
        spread = spread * (second / least) ** rng.uniform(-0.5, 0.5, draws)
    friction = mean[:, frictions].sum(axis=1) * force
    return DrawnLaws(records=records, row=row, friction=friction, spread=spread * force)


def _scores(draws: LawDraws, wanted: Mask) -> Array:
    law = draws.fit.law
    mine = wanted & np.array([column.kind == "effect" for column in law.columns])
    return np.asarray(draws.coefficients[:, mine] / law.scale[mine])


def _parameters(draws: LawDraws, effect: str, chosen: Mask) -> dict[str, Array]:
    """Parameters as in the catalogue: a line of interference by amplitude and phase."""
    values = draws.parameters(effect, chosen)
    if effect == PERIODIC_INTERFERENCE.name:
        sine, cosine = values["sine"], values["cosine"]
        values |= {"amplitude": np.hypot(sine, cosine), "phase": np.arctan2(cosine, sine)}
    return {parameter.name: values[parameter.name] for parameter in EFFECTS[effect].parameters}
