"""The law and the random force drawn from their posterior, summarised by every number of the report."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from typing import TypeVar

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.decay.spectral_lines import Line
from friction_bayes.loop.infer.law_fit import LawFit, spreads_evaluated
from friction_bayes.loop.infer.normal_above import draws_above
from friction_bayes.loop.infer.record_fit import ForceFit
from friction_bayes.mechanics.effects import EFFECTS, GrowingNoiseEffect
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE

__all__ = [
    "DRAWS",
    "LEAST_PROBABILITY",
    "DrawnLaws",
    "LawDraws",
    "by_record",
    "draw_laws",
    "shared_out",
    "unit_force",
]

_Value = TypeVar("_Value")

DRAWS = 4000
LEAST_PROBABILITY = 1e-4
"""Probability of a set at a point of the grid below which nothing is drawn from it."""
_STEPS = (0.5 * (math.sqrt(5.0) - 1.0), math.sqrt(2.0) - 1.0)
"""Multiples of each, less their whole parts, fill the unit interval evenly from any of them on, and those of
both together the unit square."""


def shared_out(draws: int, weight: Array, rng: np.random.Generator) -> Integers:
    """Number of draws from each part of a mixture, shape (parts,): in proportion to its share, within one.

    Systematic sampling (Kitagawa, J. Comput. Graph. Stat. 5, 1996), unbiased as multinomial numbers are, but
    without their scatter, which an sd due to a few far draws would inherit.
    """
    upto = np.cumsum(weight)
    # the last is one without rounding
    whole = np.floor(draws * (upto / upto[-1]) + rng.random()).astype(np.intp)
    return np.diff(whole, prepend=0)


@dataclass(frozen=True, eq=False)
class LawDraws:
    """Joint draws of coefficients, random force and noise.

    Attributes
    ----------
    coefficients : ndarray, shape (k, p)
        Natural units as the columns have them; zero where a set lacks the column.
    point, set_index : ndarray of int, shape (k,)
        Point of the grid and set of columns of each draw.
    friction : ndarray, shape (k,)
        Friction force of the declared system [N or N m].
    stiffness : ndarray, shape (k,)
        Relative correction of the stiffness.
    random_force : ndarray, shape (k,)
        Sd of the random force [N or N m]; zero without one.
    correlation_time : ndarray, shape (k,)
        Its correlation time [s].
    noise_growth : ndarray, shape (k,)
        Parameter of the noise of a sample that grows with the motion; zero where none does.
    """

    fit: ForceFit
    coefficients: Array
    point: Integers
    set_index: Integers
    friction: Array
    stiffness: Array
    random_force: Array
    correlation_time: Array
    noise_growth: Array

    def parameters(self, effect: str, chosen: Mask) -> dict[str, Array]:
        """Parameters of an effect in those of the ``chosen`` draws, of shape (k,), that have it, in order."""
        law = self.fit.law
        # a series that is cut short has nothing beyond
        found: defaultdict[str, Array] = defaultdict(lambda: np.zeros(chosen.size))
        having = np.zeros(chosen.size, np.bool_)
        held = self.fit.regression.sets[self.set_index]
        own = [j for j, column in enumerate(law.columns) if column.effect == effect]
        for columns in law.alternatives(effect):
            mine = chosen & (held[:, own] == np.isin(own, columns)).all(axis=1)
            having |= mine
            # of several lines the strongest, which comes first
            shape = law.columns[columns[0]].shape
            first = [j for j in columns if law.columns[j].shape == shape]
            for name, values in self._drawn(first, mine).items():
                found[name][mine] = values
        return {name: values[having] for name, values in found.items()}

    def lines(self, effect: str, chosen: Mask) -> list[dict[str, Array]]:
        """Parameters of each line of an effect, as :meth:`parameters` has those of the strongest."""
        law = self.fit.law
        held = self.fit.regression.sets[self.set_index]
        found: dict[Line, list[int]] = {}
        for j, column in enumerate(law.columns):
            if column.line is not None and column.effect == effect:
                found.setdefault(column.line, []).append(j)
        return [self._drawn(waves, chosen & held[:, waves].all(axis=1)) for waves in found.values()]

    def _drawn(self, columns: Sequence[int], mine: Mask) -> dict[str, Array]:
        """Coefficients of columns of one shape, and the shape parameters, in draws that have these."""
        law = self.fit.law
        found: dict[str, Array] = {}
        shape, line = law.columns[columns[0]].shape, law.columns[columns[0]].line
        for j in columns:
            column = law.columns[j]
            if column.kind == "effect":
                values = self.coefficients[mine, j]
                if column.of_friction:
                    values = values * law.friction / self.friction[mine]
                found[column.parameter] = values
        for parameter, step in zip(shape, cycle(_STEPS), strict=False):
            # the value represents its part of the prior, within which each draw has a place
            spread = (step * np.flatnonzero(mine)) % 1.0
            found[parameter.name] = np.asarray(parameter.low + (parameter.high - parameter.low) * spread)
        if line is not None and not line.steady:
            found |= line.moved(**found)
        if line is not None:
            sine, cosine = found["sine"], found["cosine"]
            found |= {"amplitude": np.hypot(sine, cosine), "phase": np.arctan2(cosine, sine)}
        return found


def _of_record(
    fit: LawFit,
    r: int,
    coefficients: Array,
    point: Integers,
    row: Integers,
    noise: Array,
    rng: np.random.Generator,
) -> LawDraws:
    """Draws of a record from its coefficients, and the points, sets and common noise of the posterior."""
    one, member = fit.fits[r], fit.problem.members[r]
    stiffness, noise = coefficients[:, one.law.stiffness], noise * member.noise
    factor = unit_force(one, stiffness)
    return LawDraws(
        fit=one,
        coefficients=coefficients,
        point=point,
        set_index=fit.problem.number[row],
        friction=coefficients[:, one.law.frictions].sum(axis=1) * factor,
        stiffness=stiffness,
        random_force=fit.posterior.ratio[point] * member.ratio(1.0) * noise * factor,
        correlation_time=fit.posterior.tau[point] / one.w0,
        noise_growth=_noise_growth(one, noise, rng),
    )


def unit_force(fit: ForceFit, stiffness: Array) -> Array:
    """Force of one natural unit [N or N m] at drawn corrections of the stiffness, shape (k,)."""
    # the factor from the friction coefficient to force stays that of the declared system
    return np.asarray(fit.law.unit_force * (1.0 + stiffness) ** (0.5 * (fit.segment.order - 2)))


def _noise_growth(fit: ForceFit, noise: Array, rng: np.random.Generator) -> Array:
    if fit.growth is None:
        return np.zeros_like(noise)
    scatter = np.exp(fit.growth.log_sd * rng.standard_normal(noise.size))
    # as the noise, of a sample: those of a block were averaged
    return np.asarray(fit.growth.ratio * noise * scatter * np.sqrt(fit.segment.block))


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
        friction = self.first.friction
        return replace(self, records=self.records[:1], friction=friction, spread=np.zeros_like(friction))

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
            name = EFFECTS[effect].parameters[0].name
            return by_record(
                {name: draws.noise_growth[chosen]} if effect in draws.fit.sensor_noise.effects else {}
                for draws in self.records
            )
        if effect == RANDOM_FORCE.name:
            return {
                "sd": self.first.random_force[chosen],
                "correlation_time": self.first.correlation_time[chosen],
            }
        own = any(column.own for column in self.first.fit.law.columns if column.effect == effect)
        if len(self.records) == 1 or not own:
            # a share of friction is one of the mean friction
            return _parameters(replace(self.first, friction=self.friction), effect, chosen)
        return by_record(_parameters(draws, effect, chosen) for draws in self.records)


def by_record(records: Iterable[Mapping[str, _Value]]) -> dict[str, _Value]:
    """Values of some records by name, with the record's number where there are several."""
    each = list(records)
    return {
        f"{name}[{r}]" if len(each) > 1 else name: value
        for r, own in enumerate(each)
        for name, value in own.items()
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
        given = problem.conditional(posterior.points[g], m)
        low = np.where(problem.positive[given.columns], 0.0, -np.inf)
        shared = draws_above(low, given.mean, given.covariance, rng, k)
        mean[here, given.columns] = shared
        laws[here] = given.laws(shared, rng)
        point[here], row[here], noise[here] = g, m, given.noise
        at += k
    records = tuple(_of_record(fit, r, laws[:, r], point, row, noise, rng) for r in range(len(fit.fits)))
    frictions = fit.law.frictions
    force = unit_force(fit.fits[0], records[0].stiffness)
    spread = fit.level * fit.spread_of[row]
    if not fit.one:
        # a spread represents its part of the prior
        least, second = spreads_evaluated()[:2]
        spread = spread * (second / least) ** rng.uniform(-0.5, 0.5, draws)
    friction = mean[:, frictions].sum(axis=1) * force
    return DrawnLaws(records=records, row=row, friction=friction, spread=spread * force)


def _scores(draws: LawDraws, wanted: Mask) -> Array:
    law = draws.fit.law
    mine = wanted & np.array([column.kind == "effect" for column in law.columns])
    return np.asarray(draws.coefficients[:, mine] / draws.fit.regression.scale[mine])


def _parameters(draws: LawDraws, effect: str, chosen: Mask) -> dict[str, Array]:
    """Parameters as in the catalogue: a line of interference by amplitude and phase."""
    values = draws.parameters(effect, chosen)
    return {parameter.name: values[parameter.name] for parameter in EFFECTS[effect].parameters}
