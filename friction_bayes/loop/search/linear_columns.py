"""Every effect of the catalogue as columns of one linear problem about a fit.

The signal's derivatives in the coordinates of the fit, and in those of each effect that may be added, are
the columns; their weighted inner products with each other and with the residual are taken once, record by
record. Any set of effects is a sub-block of these Gram matrices.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import Coordinate
from friction_bayes.loop.noise.likelihood import whiten
from friction_bayes.loop.search.derivatives import derivative, first_step
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.loop.search.spectral_lines import SpectralLine, strongest_lines
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE

__all__ = ["LinearColumns", "Linearised"]

_SCORES = (-2.0, -1.0, 0.0, 1.0)
"""Where a parameter that only shapes a term is tried, as normal scores of its prior."""


@dataclass(frozen=True, eq=False)
class Linearised:
    """An effect that is not in the fit, linearised at one value of its shape.

    Attributes
    ----------
    effect : str
    coordinates : tuple of Coordinate
    columns : slice
        Its columns in the linear problem.
    line : SpectralLine, optional
        Where the columns are sines and cosines and no coordinates.
    shift : int, optional
        Column of the signal's change at the point of linearisation, which comes whole or not at all.
    """

    effect: str
    coordinates: tuple[Coordinate, ...]
    columns: slice
    line: SpectralLine | None = None
    shift: int | None = None


class _Column(NamedTuple):
    """Where a column was linearised, its prior precision, and its coordinate if it is that of one."""

    origin: float
    precision: float
    coordinate: Coordinate | None


class LinearColumns:
    """The linear problem about a fit.

    Parameters
    ----------
    fit : LoopFit
    allowed : sequence of str
        Effects that may be added.

    Attributes
    ----------
    linearised : dict
        By name, each effect that may be added at the shapes that were tried.
    grams : ndarray, shape (R, q, q)
        Weighted inner products of the ``q`` columns in each of the ``R`` records; those of the fit come
        first.
    gradients : ndarray, shape (R, q)
        Weighted inner products of the columns with the residual.
    squares : ndarray, shape (R,)
        Weighted sum of squares of the residual.
    origin, precision : ndarray, shape (q,)
        Where each column was linearised, and its prior precision.
    low, high, log_normalisation, least_precision : ndarray, shape (q,)
        Support, normalisation and least precision of the priors.
    coordinates : tuple of Coordinate or None
        What the column belongs to; None where it is no coordinate.
    """

    def __init__(self, fit: LoopFit, allowed: Sequence[str]) -> None:
        self.fit = fit
        self.linearised: dict[str, list[Linearised]] = {}
        self._columns = [
            _Column(x, c.precision, c) for x, c in zip(fit.z.tolist(), fit.model.coordinates, strict=True)
        ]
        blocks = [[jacobian] for jacobian in fit.jacobians]
        for name in allowed:
            if name not in fit.model.effects:
                for added in self._added_columns(name):
                    for r, columns in enumerate(added):
                        blocks[r].append(columns)
        grams, gradients, squares = [], [], []
        for block, noise in zip(blocks, fit.noises, strict=True):
            full = np.hstack(block)
            weighted = full * noise.weight[:, None]
            grams.append(weighted.T @ full)
            gradients.append(weighted.T @ noise.residual)
            squares.append(float(noise.weight @ noise.residual**2))
        self.grams, self.gradients, self.squares = np.array(grams), np.array(gradients), np.array(squares)
        self.origin = np.array([column.origin for column in self._columns])
        self.precision = np.array([column.precision for column in self._columns])
        self.coordinates = own = tuple(column.coordinate for column in self._columns)
        support = np.array([(-math.inf, math.inf) if c is None else c.support for c in own])
        self.low, self.high = support[:, 0], support[:, 1]
        self.log_normalisation = np.array([0.0 if c is None else c.log_normalisation for c in own])
        self.least_precision = np.array([0.0 if c is None else c.least_precision for c in own])

    def _added_columns(self, name: str) -> Iterator[list[Array]]:
        """Columns of each record for an effect, shape by shape; each is noted in ``linearised``."""
        model = self.fit.model.with_effects((*self.fit.model.effects, name))
        coordinates = tuple(c for c in model.coordinates if c.effect == name)
        if name != PERIODIC_INTERFERENCE.name:
            yield from self._derivative_columns(name, model, coordinates)
            return
        for line in strongest_lines(self.fit):
            columns = self._append([_Column(0.0, p, None) for p in line.prior(coordinates)])
            self._note(Linearised(name, coordinates, columns, line=line))
            yield line.columns

    def _derivative_columns(
        self, name: str, model: LoopModel, coordinates: tuple[Coordinate, ...]
    ) -> Iterator[list[Array]]:
        fit = self.fit
        known = {c.key: x for c, x in zip(fit.model.coordinates, fit.z, strict=True)}
        z = np.array([known.get(c.key, 0.0) for c in model.coordinates])
        mine = [model.index(c.name, effect=c.effect, record=c.record) for c in coordinates]
        for score in _SCORES if any(c.shapes for c in coordinates) else (0.0,):
            z[mine] = [c.at_score(score) if c.shapes else c.start for c in coordinates]
            bases = [model.predict(z, r) for r in range(len(fit.noises))]
            added, shifted = [], False
            for r, base in enumerate(bases):
                if base is None:
                    break
                own = [derivative(model, z, r, j, first_step(model, j), base) for j in mine]
                # where no parameter has a null the term has moved the signal already
                shift = base.signal - fit.predictions[r].signal
                shifted |= bool(np.any(shift != 0.0))
                added.append(whiten(np.column_stack([*own, shift]), fit.noise_models[r].ar))
            else:
                pairs = zip(z[mine].tolist(), coordinates, strict=True)
                columns = self._append([_Column(x, c.precision, c) for x, c in pairs])
                self._append([_Column(0.0, 0.0, None)])
                shift_column = columns.stop if shifted else None
                self._note(Linearised(name, coordinates, columns, shift=shift_column))
                yield added

    def _append(self, columns: Sequence[_Column]) -> slice:
        first = len(self._columns)
        self._columns += columns
        return slice(first, first + len(columns))

    def _note(self, linearised: Linearised) -> None:
        self.linearised.setdefault(linearised.effect, []).append(linearised)
