"""What every set of effects would be worth, to second order about one fit.

The derivatives of the signal in everything that the catalogue may add are taken once, at the fit. The
posterior of any set of effects, those of the fit dropped or kept, is then a small linear problem: its
solution is where that set's own fit should start, and its value says whether to fit it at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.noise import whiten
from friction_bayes.loop.parameters import Coordinate
from friction_bayes.loop.spectral_lines import SpectralLine, strongest_lines
from friction_bayes.loop.truncated_normal import log_interval_probability
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE

__all__ = ["Approximation", "Expansion", "is_identifiable"]

_SCORES = (-2.0, -1.0, 0.0, 1.0)
"""Where a parameter that only shapes a term is tried, as normal scores of its prior."""
_VERSIONS = 2
"""Versions of an effect, of those tried, that go on into combinations."""
_LEAST_INFORMATION = 0.3
"""An effect of which the samples tell less, in units of what the prior tells, cannot be seen: not weighed."""
_LEAST_SHARE = 1e-4
"""A residual is not promised to fall below this share of its sum of squares."""

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


@dataclass(frozen=True, eq=False)
class _Version:
    """An effect that is not in the fit: where it was linearised, and its columns in the whole problem."""

    effect: str
    coordinates: tuple[Coordinate, ...]
    columns: slice
    line: SpectralLine | None = None
    offset: int | None = None


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
        self._versions: dict[str, list[_Version]] = {}
        self._at: list[float] = fit.z.tolist()
        self._owners: list[Coordinate | None] = list(fit.model.coordinates)
        self._prior = [c.precision for c in fit.model.coordinates]
        columns = [[jacobian] for jacobian in fit.jacobians]
        for name in allowed:
            if name not in fit.model.effects:
                for added in self._linearised(name):
                    for r, column in enumerate(added):
                        columns[r].append(column)
        matrices, gradients, squares = [], [], []
        for r, noise in enumerate(fit.noises):
            full = np.hstack(columns[r])
            weighted = full * noise.weight[:, None]
            matrices.append(weighted.T @ full)
            gradients.append(weighted.T @ noise.residual)
            squares.append(float(noise.weight @ noise.residual**2))
        self._matrices, self._gradients = np.array(matrices), np.array(gradients)
        self._squares = np.array(squares)
        self._plain = np.array([not (f.outliers or f.censored) for f in fit.noise_models])
        own = self._owners
        support = np.array([(-math.inf, math.inf) if c is None else c.support for c in own])
        self._low, self._high = support[:, 0], support[:, 1]
        self._normalisation = np.array([0.0 if c is None else c.log_normalisation for c in own])
        self._least = np.array([0.0 if c is None else c.least_precision for c in own])
        self._origin, self._precision = np.array(self._at), np.array(self._prior)
        present = frozenset(fit.model.effects)
        self._reference = self._judge(present, ())[0]
        for name, versions in self._versions.items():
            seen = [(self._judge(present | {name}, (v,))[0], v) for v in versions if self._is_seen(v)]
            seen.sort(key=lambda pair: -pair[0])
            self._versions[name] = [v for _, v in seen[:_VERSIONS]]

    @property
    def seen(self) -> Names:
        """Effects beyond those of the fit of which the samples say anything."""
        return frozenset(name for name, versions in self._versions.items() if versions)

    def approximations(self, most: int, uncounted: Names = frozenset()) -> Iterator[Approximation]:
        """Judge every set of at most ``most`` effects, those ``uncounted`` besides."""
        present = self._fit.model.effects
        names = [name for name in EFFECTS if name in present or self._versions.get(name)]
        besides = [name for name in names if name in uncounted]
        counted = [name for name in names if name not in uncounted]
        for size, more in product(range(most + 1), range(len(besides) + 1)):
            for first, second in product(combinations(counted, size), combinations(besides, more)):
                chosen = frozenset(first + second)
                if any(other in chosen for name in chosen for other in EFFECTS[name].excludes):
                    continue
                approximation = self._best(chosen, [n for n in names if n in chosen and n not in present])
                if approximation is not None:
                    yield approximation

    def _best(self, names: Names, new: Sequence[str]) -> Approximation | None:
        """The best versions of a set; None where one of its effects cannot be told from the others."""
        tried = [(self._judge(names, v), v) for v in product(*(self._versions[name] for name in new))]
        (value, objective, reached, told), versions = max(tried, key=lambda t: t[0][0])
        if not told:
            return None
        start = {
            c.key: float(x)
            for c, x in zip(self._fit.model.coordinates, reached, strict=False)
            if not c.effect or c.effect in names
        }
        for version in versions:
            own = reached[version.columns]
            if version.line is not None:
                own = version.line.start(version.coordinates, own)
            start |= {c.key: float(x) for c, x in zip(version.coordinates, own, strict=True)}
        return Approximation(names, value - self._reference, objective, start)

    def _linearised(self, name: str) -> Iterator[list[Array]]:
        """Derivatives of each record's signal in an effect, version by version, which are noted down."""
        fit = self._fit
        model = fit.model.with_effects((*fit.model.effects, name))
        mine = [i for i, c in enumerate(model.coordinates) if c.effect == name]
        coordinates = tuple(model.coordinates[i] for i in mine)
        if name == PERIODIC_INTERFERENCE.name:
            for line in strongest_lines(fit):
                self._note(name, coordinates, np.zeros(line.size), line.prior(coordinates), line=line)
                yield list(line.columns)
            return
        known = {c.key: x for c, x in zip(fit.model.coordinates, fit.z, strict=True)}
        z = np.array([known.get(c.key, 0.0) for c in model.coordinates])
        for score in _SCORES if any(c.shapes for c in coordinates) else (0.0,):
            z[mine] = [c.at_score(score) if c.shapes else c.start for c in coordinates]
            bases = [model.predict(z, r) for r in range(len(fit.noises))]
            added, changed = [], False
            for r, base in enumerate(bases):
                if base is None:
                    break
                own = [model.difference(z, i, model.first_step(i), r, base) for i in mine]
                # where no parameter has a null the term has moved the signal already
                change = base.signal - fit.predictions[r].signal
                changed |= bool(np.any(change != 0.0))
                added.append(whiten(np.column_stack([*own, change]), fit.noise_models[r].ar))
            else:
                self._note(name, coordinates, z[mine], [c.precision for c in coordinates], changed=changed)
                yield added

    def _note(
        self,
        name: str,
        coordinates: tuple[Coordinate, ...],
        at: Array,
        prior: Sequence[float],
        *,
        line: SpectralLine | None = None,
        changed: bool = False,
    ) -> None:
        first = len(self._at)
        columns = slice(first, first + at.size)
        self._at += at.tolist()
        self._prior += prior
        self._owners += [None] * at.size if line is not None else coordinates
        if line is None:
            # the column of what the term has moved already is no parameter
            self._at.append(0.0)
            self._prior.append(0.0)
            self._owners.append(None)
        offset = columns.stop if changed else None
        self._versions.setdefault(name, []).append(_Version(name, coordinates, columns, line, offset))

    def _is_seen(self, version: _Version) -> bool:
        """Whether the samples say anything of its parameters, no other effect acting."""
        if version.line is not None:
            return True
        always = [i for i, c in enumerate(self._fit.model.coordinates) if not c.effect]
        matrix = self._matrices.sum(axis=0)
        cross = matrix[always, version.columns]
        known = np.linalg.solve(self._fit.precision[np.ix_(always, always)], cross)
        left = matrix[version.columns, version.columns] - cross.T @ known
        return bool(np.any(np.diag(left) > _LEAST_INFORMATION * self._precision[version.columns]))

    def _judge(self, names: Names, versions: Sequence[_Version]) -> tuple[float, float, Array, bool]:
        """Log-evidence and objective up to constants of the fit, the mode, whether all effects are seen."""
        moved = np.zeros(self._origin.size)
        free = []
        for i, (c, x) in enumerate(zip(self._fit.model.coordinates, self._fit.z, strict=True)):
            if not c.effect or c.effect in names:
                free.append(i)
            elif not c.shapes and not c.circular:
                # what the fit has and the set has not goes back to its null
                moved[i] = c.start - x
        for version in versions:
            free += range(version.columns.start, version.columns.stop)
            if version.offset is not None:
                moved[version.offset] = 1.0
        index = np.array(free)
        matrices = self._matrices[:, index[:, None], index]
        forces = self._gradients[:, index] - self._matrices[:, index] @ moved
        origin, prior = self._origin[index], self._precision[index]
        owners = [self._owners[i] for i in free]
        scale = np.ones(len(matrices))
        for _ in range(2):
            curvature = np.tensordot(scale, matrices, 1) + np.diag(prior + 1e-12)
            moved[index] = _inverse(curvature) @ (scale @ forces - prior * origin)
            deviance, scale = self._deviance(moved)
        reached = self._origin + moved
        mode = reached[index]
        objective = deviance + float(prior @ mode**2)
        covariance = _inverse(curvature + np.diag(self._least[index]))
        sd = np.sqrt(np.diag(covariance))
        ends = (self._low[index] - mode) / sd, (self._high[index] - mode) / sd
        value = -0.5 * objective + 0.5 * float(np.linalg.slogdet(covariance)[1])
        value += 0.5 * index.size * math.log(2.0 * math.pi) + float(self._normalisation[index].sum())
        value += float(log_interval_probability(*ends).sum())
        for version in versions:
            if version.line is not None:
                own = reached[version.columns]
                lines = self._matrices[:, version.columns, version.columns].sum(axis=0)
                value += version.line.log_volume(version.coordinates, own, float(own @ lines @ own))
        variance = np.diag(covariance)
        told = _all_identified([(c, v) for c, v in zip(owners, variance, strict=True) if c is not None])
        return value, objective - self._fit.objective, reached, told

    def _deviance(self, moved: Array) -> tuple[float, Array]:
        """Deviance after a step, and by how much the weights grow with the smaller noise."""
        change = np.einsum("i,rij,j->r", moved, self._matrices, moved) - 2.0 * self._gradients @ moved
        share = np.maximum(1.0 + change / self._squares, _LEAST_SHARE)
        total = math.fsum(n.deviance for n in self._fit.noises)
        total += float(np.where(self._plain, self._squares * np.log(share), change).sum())
        return total, np.where(self._plain, 1.0 / share, 1.0)


def _inverse(matrix: Array) -> Array:
    """Inverse of a positive matrix whose coordinates are known to very different accuracy."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    return np.asarray(np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale))


def is_identifiable(fit: LoopFit) -> bool:
    """Whether the samples tell each effect of a fit from the others of it, and from friction and state."""
    return _all_identified(list(zip(fit.model.coordinates, np.diag(fit.covariance), strict=True)))


def _all_identified(coordinates: Sequence[tuple[Coordinate, float]]) -> bool:
    """Whether of each effect some parameter is known better than by its prior alone."""
    learnt = {
        c.effect for c, variance in coordinates if 1.0 / variance > (1.0 + _LEAST_INFORMATION) * c.precision
    }
    return {c.effect for c, _ in coordinates} <= learnt
