"""What one more effect would gain, to first order, and where its fit should start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ndtr

from friction_bayes.loop.coordinates import Coordinate
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.model import LoopModel
from friction_bayes.loop.noise import whiten
from friction_bayes.mechanics.effects import EFFECTS

__all__ = ["Addition", "additions"]

_GRID = (-2.0, -1.0, 0.0, 1.0)
"""Where a log-normal parameter is tried, in prior standard deviations of its logarithm."""
_LINES = 2
"""Spectral lines of the residual from which interference is tried."""
_LEAST_PERIODS = 2
"""Periods of a line within the record; with fewer it is a drift."""
_LEAST_INFORMATION = 1.0
"""An effect of which the samples tell less than the prior cannot be seen in it: it is not weighed."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Addition:
    """One effect on top of a fit.

    Attributes
    ----------
    effect : str
    parent : LoopFit
    log_gain : float
        Log-evidence gained, to first order.
    own : ndarray, shape (k,)
        Start of the effect's coordinates.
    shift : ndarray, shape (p,)
        Step of the parent's coordinates that goes with it.
    """

    effect: str
    parent: LoopFit
    log_gain: float
    own: Array
    shift: Array

    def start(self, model: LoopModel) -> Array:
        """Start in the coordinates of the model with the effect."""
        known = {
            (c.effect, c.name, c.record): x
            for c, x in zip(self.parent.model.coordinates, self.parent.z + self.shift, strict=True)
        }
        mine = iter(self.own)
        return np.array(
            [
                next(mine) if c.effect == self.effect else known[c.effect, c.name, c.record]
                for c in model.coordinates
            ]
        )


def additions(fit: LoopFit, names: Sequence[str]) -> list[Addition]:
    """First-order gain of each effect that changes the signal."""
    factor = cho_factor(fit.precision)
    found = []
    for name in names:
        model = LoopModel(fit.model.system, fit.model.segments, _in_order((*fit.model.effects, name)))
        mine = [i for i, c in enumerate(model.coordinates) if c.effect == name]
        tried = [_linear_step(fit, factor, model, name, mine, start) for start in _starts(fit, model, mine)]
        usable = [addition for addition in tried if addition is not None]
        if usable:
            found.append(max(usable, key=lambda a: a.log_gain))
    return found


def _in_order(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in EFFECTS if name in names)


def _starts(fit: LoopFit, model: LoopModel, mine: Sequence[int]) -> list[Array]:
    """Coordinates of the effect to linearise at: its null, over a grid of what has none."""
    coordinates = [model.coordinates[i] for i in mine]
    if any(c.prior.family == "uniform" for c in coordinates):
        return _line_starts(fit, coordinates)
    shapes = [c.prior.family == "log-normal" for c in coordinates]
    if not any(shapes):
        return [np.zeros(len(mine))]
    return [np.where(shapes, at, 0.0) for at in _GRID]


def _line_starts(fit: LoopFit, coordinates: Sequence[Coordinate]) -> list[Array]:
    """Amplitude, frequency and phase of the strongest lines in the residual of each record together."""
    r = int(np.argmax([segment.values.size for segment in fit.model.segments]))
    step = fit.model.segments[r].decay.step
    residual = fit.noises[r].residual * (fit.noises[r].weight > 0.0)
    limit = 4.0 * fit.noises[r].sd
    residual = np.clip(residual, -limit, limit)
    n = residual.size
    size = 1 << (4 * n - 1).bit_length()
    spectrum = np.fft.rfft(residual * np.hanning(n), size)
    power = np.abs(spectrum)
    power[: _LEAST_PERIODS * size // n] = 0.0
    starts = []
    for _ in range(_LINES):
        peak = int(np.argmax(power))
        frequency = peak / (size * step)
        values = []
        for segment, noise in zip(fit.model.segments, fit.noises, strict=True):
            angle = 2.0 * math.pi * frequency * segment.time
            design = np.column_stack([np.sin(angle), np.cos(angle)])
            sine, cosine = np.linalg.lstsq(design, noise.residual * (noise.weight > 0.0), rcond=None)[0]
            values += [math.hypot(sine, cosine), frequency, math.atan2(cosine, sine)]
        starts.append(np.array([c.coordinate(v) for c, v in zip(coordinates, values, strict=True)]))
        power[max(peak - 8 * size // n, 0) : peak + 8 * size // n] = 0.0
    return starts


def _linear_step(
    fit: LoopFit,
    factor: tuple[Array, bool],
    model: LoopModel,
    name: str,
    mine: Sequence[int],
    start: Array,
) -> Addition | None:
    coordinates = [model.coordinates[i] for i in mine]
    prior = np.array([c.precision for c in coordinates])
    z = np.empty(len(model.coordinates))
    z[[i for i in range(z.size) if i not in set(mine)]] = _aligned(fit, model)
    z[list(mine)] = start
    k = len(mine)
    cross = np.zeros((fit.z.size, k))
    own = np.diag(prior + [c.least_precision for c in coordinates])
    gradient = -prior * start
    gained = 0.0
    for r, noise in enumerate(fit.noises):
        base = model.predict(z, r)
        if base is None:
            return None
        columns = np.column_stack([model.difference(z, i, model.first_step(i), r, base) for i in mine])
        columns = whiten(columns, fit.forms[r].ar)
        # a start away from the null has moved the signal already
        moved = whiten(fit.predictions[r].signal - base.signal, fit.forms[r].ar)
        residual = noise.residual + moved
        weighted = columns * noise.weight[:, None]
        own += weighted.T @ columns
        cross += fit.jacobians[r].T @ weighted
        gradient += weighted.T @ residual
        gained += float(noise.weight @ (noise.residual**2 - residual**2))
    solved = cho_solve(factor, cross)
    schur = own - cross.T @ solved
    schur = 0.5 * (schur + schur.T) + 1e-9 * np.diag(np.diag(own))
    if np.all(np.diag(schur) < prior + _LEAST_INFORMATION):
        return None
    step = np.linalg.solve(schur, gradient)
    half = 0.5 * gained + 0.5 * float(gradient @ step) - 0.5 * float(prior @ start**2)
    sd = np.sqrt(np.diag(np.linalg.inv(schur)))
    log_gain = half - 0.5 * float(np.linalg.slogdet(schur)[1]) + 0.5 * k * math.log(2.0 * math.pi)
    for c, x, s in zip(coordinates, start + step, sd, strict=True):
        low, high = c.support
        mass = float(ndtr((high - x) / s) - ndtr((low - x) / s))
        log_gain += c.log_normalisation + math.log(max(mass, 1e-12))
    return Addition(name, fit, log_gain, start + step, -solved @ step)


def _aligned(fit: LoopFit, model: LoopModel) -> Array:
    """The fit's coordinates in the order of the larger model, the new effect left out."""
    known = {(c.effect, c.name, c.record): x for c, x in zip(fit.model.coordinates, fit.z, strict=True)}
    keys = [(c.effect, c.name, c.record) for c in model.coordinates]
    return np.array([known[key] for key in keys if key in known])
