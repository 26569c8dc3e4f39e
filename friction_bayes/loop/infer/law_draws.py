"""Draws of the law of one record and of its random force, summarised by every number of the report."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from friction_bayes.core.arrays import Array, Integers, Mask
from friction_bayes.loop.columns.lines import Line
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["LawDraws", "laws_drawn", "unit_force"]

_STEPS = (0.5 * (math.sqrt(5.0) - 1.0), math.sqrt(2.0) - 1.0)
"""Multiples of each, less their whole parts, fill the unit interval evenly from any of them on, and those of
both together the unit square."""


@dataclass(frozen=True, eq=False)
class LawDraws:
    """Joint draws of coefficients, random force and noise.

    Attributes
    ----------
    coefficients : ndarray, shape (k, p)
        Natural units as the columns have them; zero where a set lacks the column.
    point, chosen : ndarray of int, shape (k,)
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
    chosen: Integers
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
        held = self.fit.sets.columns[self.chosen]
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
        held = self.fit.sets.columns[self.chosen]
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
        return found


def laws_drawn(
    fit: ForceFit,
    coefficients: Array,
    *,
    point: Integers,
    chosen: Integers,
    ratio: Array,
    tau: Array,
    noise: Array,
    rng: np.random.Generator,
) -> LawDraws:
    """Draws with these coefficients and random forces ``ratio`` times the noise, and derived quantities."""
    stiffness = coefficients[:, fit.law.always[2]]
    factor = unit_force(fit, stiffness)
    return LawDraws(
        fit=fit,
        coefficients=coefficients,
        point=point,
        chosen=chosen,
        friction=coefficients[:, fit.law.frictions].sum(axis=1) * factor,
        stiffness=stiffness,
        random_force=ratio * noise * factor,
        correlation_time=tau / fit.w0,
        noise_growth=_noise_growth(fit, noise, rng),
    )


def unit_force(fit: ForceFit, stiffness: Array) -> Array:
    """Force of one natural unit [N or N m] at drawn corrections of the stiffness, shape (k,)."""
    # the factor from the friction coefficient to force stays that of the declared system
    return np.asarray(fit.law.unit_force * (1.0 + stiffness) ** (0.5 * (fit.segment.order - 2)))


def _noise_growth(fit: ForceFit, noise: Array, rng: np.random.Generator) -> Array:
    if fit.growth is None or not fit.growth.found:
        return np.zeros_like(noise)
    scatter = np.exp(fit.growth.log_sd * rng.standard_normal(noise.size))
    # as the noise, of a sample: those of a block were averaged
    return np.asarray(fit.growth.ratio * noise * scatter * np.sqrt(fit.segment.block))
