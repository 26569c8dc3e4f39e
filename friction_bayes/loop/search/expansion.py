"""What every set of effects would be worth, to second order about one fit.

The posterior of any set of effects, those of the fit dropped or kept, is a sub-block of one linear problem
(see :mod:`friction_bayes.loop.search.linear_columns`): its solution is where that set's own fit should start,
and its evidence says whether to fit it at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.loop import settings
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import Coordinate
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.linear_columns import LinearColumns, Linearised
from friction_bayes.loop.search.truncated_normal import log_interval_probability
from friction_bayes.mechanics.effects import EFFECTS

__all__ = ["Approximation", "Expansion", "is_identifiable"]

_SHAPES = 2
"""Shapes of an effect, of those tried, that go on into combinations."""
_LEAST_SHARE = 1e-4
"""A residual is not promised to fall below this share of its sum of squares."""
_ROUNDING = 1e-12
"""Added to the prior precision, so that flat priors leave a matrix that can be inverted."""

Names = frozenset[str]


@dataclass(frozen=True, eq=False)
class Approximation:
    """One set of effects, to second order.

    Attributes
    ----------
    effects : frozenset of str
        Those that change the signal.
    log_gain : float
        Log-evidence over that of the fit expanded about, both to second order.
    objective : float
        Deviance with the prior over that of the fit.
    start : dict
        Coordinate of each parameter by effect, name and record.
    """

    effects: Names
    log_gain: float
    objective: float
    start: dict[tuple[str, str, int], float]

    def coordinates(self, model: LoopModel) -> Array:
        """Start in the coordinates of a model with these effects."""
        return np.array([self.start[c.key] for c in model.coordinates])


class _Solution(NamedTuple):
    """Posterior of a set: evidence and objective up to constants of the fit, and the mode of all columns."""

    log_evidence: float
    objective: float
    mode: Array
    identifiable: bool


class Expansion:
    """The second-order problem about a fit.

    Parameters
    ----------
    fit : LoopFit
    allowed : sequence of str
        Effects that may be added.
    """

    def __init__(self, fit: LoopFit, allowed: Sequence[str]) -> None:
        self._fit = fit
        self._problem = LinearColumns(fit, allowed)
        # with outliers or clipped samples the noise scale is not that of the sum of squares
        self._rescaled = np.array([not (m.outliers or m.censored) for m in fit.noise_models])
        present = frozenset(fit.model.effects)
        self._reference = self._solve(present, ()).log_evidence
        self._shapes = {
            name: self._best_shapes(present | {name}, tried)
            for name, tried in self._problem.linearised.items()
        }

    def _best_shapes(self, names: Names, tried: Sequence[Linearised]) -> list[Linearised]:
        informed = [(self._solve(names, (one,)).log_evidence, one) for one in tried if self._is_informed(one)]
        informed.sort(key=lambda pair: -pair[0])
        return [one for _, one in informed[:_SHAPES]]

    @property
    def informed(self) -> Names:
        """Effects beyond those of the fit on which the samples hold information."""
        return frozenset(name for name, shapes in self._shapes.items() if shapes)

    def approximations(self, most: int, uncounted: Names = frozenset()) -> Iterator[Approximation]:
        """Approximate every set of at most ``most`` effects, those ``uncounted`` besides."""
        present = self._fit.model.effects
        names = [name for name in EFFECTS if name in present or self._shapes.get(name)]
        besides = [name for name in names if name in uncounted]
        counted = [name for name in names if name not in uncounted]
        for size, more in product(range(most + 1), range(len(besides) + 1)):
            for first, second in product(combinations(counted, size), combinations(besides, more)):
                chosen = frozenset(first + second)
                if any(other in chosen for name in chosen for other in EFFECTS[name].excludes):
                    continue
                new = [name for name in names if name in chosen and name not in present]
                approximation = self._approximation(chosen, new)
                if approximation is not None:
                    yield approximation

    def _approximation(self, names: Names, new: Sequence[str]) -> Approximation | None:
        """A set at its best shapes; None where an effect is not identifiable."""
        tried = [(self._solve(names, shapes), shapes) for shapes in product(*(self._shapes[n] for n in new))]
        solution, shapes = max(tried, key=lambda pair: pair[0].log_evidence)
        if not solution.identifiable:
            return None
        start = {
            c.key: float(x)
            for c, x in zip(self._fit.model.coordinates, solution.mode, strict=False)
            if not c.effect or c.effect in names
        }
        for shape in shapes:
            own = solution.mode[shape.columns]
            if shape.line is not None:
                own = shape.line.start(shape.coordinates, own)
            start |= {c.key: float(x) for c, x in zip(shape.coordinates, own, strict=True)}
        return Approximation(names, solution.log_evidence - self._reference, solution.objective, start)

    def _is_informed(self, shape: Linearised) -> bool:
        """Whether the samples hold information on any of its parameters, no other effect acting."""
        if shape.line is not None:
            return True
        always = [j for j, c in enumerate(self._fit.model.coordinates) if not c.effect]
        gram = self._problem.grams.sum(axis=0)
        cross = gram[always, shape.columns]
        absorbed = np.linalg.solve(self._fit.precision[np.ix_(always, always)], cross)
        left = gram[shape.columns, shape.columns] - cross.T @ absorbed
        least = settings.SETTINGS.least_information * self._problem.precision[shape.columns]
        return bool(np.any(np.diag(left) > least))

    def _solve(self, names: Names, shapes: Sequence[Linearised]) -> _Solution:
        """Posterior of a set whose new effects have these shapes."""
        problem = self._problem
        index, step = self._sub_block(names, shapes)
        grams = problem.grams[:, index[:, None], index]
        gradients = problem.gradients[:, index] - problem.grams[:, index] @ step
        prior = problem.precision[index]
        scale = np.ones(len(grams))
        # once more with the noise that the first solution leaves
        for _ in range(2):
            precision = np.einsum("r,rij->ij", scale, grams)
            np.einsum("ii->i", precision)[:] += prior + _ROUNDING
            step[index] = _inverse(precision) @ (scale @ gradients - prior * problem.origin[index])
            deviance, scale = self._deviance(step)
        mode = problem.origin + step
        objective = deviance + float(prior @ mode[index] ** 2)
        covariance = _inverse(precision + np.diag(problem.least_precision[index]))
        log_evidence = -0.5 * objective + self._log_volume(index, mode, covariance)
        for shape in shapes:
            if shape.line is not None:
                own = mode[shape.columns]
                gram = problem.grams[:, shape.columns, shape.columns].sum(axis=0)
                log_evidence += shape.line.log_volume(shape.coordinates, own, float(own @ gram @ own))
        pairs = zip(index, np.diag(covariance), strict=True)
        variances = [(c, v) for j, v in pairs if (c := problem.coordinates[j]) is not None]
        return _Solution(log_evidence, objective - self._fit.objective, mode, _all_identified(variances))

    def _sub_block(self, names: Names, shapes: Sequence[Linearised]) -> tuple[Indices, Array]:
        """Columns that a set leaves free, and the step from the fit that it makes in the others."""
        step = np.zeros(self._problem.origin.size)
        free: list[int] = []
        for j, (c, x) in enumerate(zip(self._fit.model.coordinates, self._fit.z, strict=True)):
            if not c.effect or c.effect in names:
                free.append(j)
            elif not c.shapes and not c.circular:
                # what the fit has and the set has not goes back to its null
                step[j] = c.start - x
        for shape in shapes:
            free += range(shape.columns.start, shape.columns.stop)
            if shape.shift is not None:
                step[shape.shift] = 1.0
        return np.array(free), step

    def _log_volume(self, index: Indices, mode: Array, covariance: Array) -> float:
        """Logarithm of posterior volume, prior normalisation and probability of the support."""
        problem = self._problem
        sd = np.sqrt(np.diag(covariance))
        low = (problem.low[index] - mode[index]) / sd
        high = (problem.high[index] - mode[index]) / sd
        value = 0.5 * float(np.linalg.slogdet(covariance)[1]) + 0.5 * index.size * math.log(2.0 * math.pi)
        value += float(problem.log_normalisation[index].sum())
        return value + float(log_interval_probability(low, high).sum())

    def _deviance(self, step: Array) -> tuple[float, Array]:
        """Deviance after a step, and by how much the weights grow with the smaller noise."""
        problem = self._problem
        change = (problem.grams @ step - 2.0 * problem.gradients) @ step
        share = np.maximum(1.0 + change / problem.squares, _LEAST_SHARE)
        total = math.fsum(n.deviance for n in self._fit.noises)
        total += float(np.where(self._rescaled, problem.squares * np.log(share), change).sum())
        return total, np.where(self._rescaled, 1.0 / share, 1.0)


def _inverse(matrix: Array) -> Array:
    """Inverse of a positive matrix whose coordinates are known to very different accuracy.

    Once scaled, NumPy's inverse is as good as Cholesky's (variances within 1e-9) in under half the time.
    """
    scale = 1.0 / np.sqrt(np.diag(matrix))
    unit = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(matrix * unit) * unit)


def is_identifiable(fit: LoopFit) -> bool:
    """Whether the samples distinguish each effect of a fit from the others, from friction and state."""
    return _all_identified(list(zip(fit.model.coordinates, np.diag(fit.covariance), strict=True)))


def _all_identified(variances: Sequence[tuple[Coordinate, float]]) -> bool:
    """Whether of each effect some parameter is known better than by its prior alone."""
    known = 1.0 + settings.SETTINGS.least_information
    identified = {c.effect for c, variance in variances if 1.0 / variance > known * c.precision}
    return {c.effect for c, _ in variances} <= identified
