"""Fit a loop model to whole signals: Levenberg and Marquardt on the posterior of a growing record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import NoiseModel
from friction_bayes.loop.search.objective import Objective, Point

__all__ = ["LoopFit", "fit_growing_record", "fit_model"]

_ITERATIONS = 25
_PROMISED = 5e-4
"""Fall of the deviance that a step has to promise to be tried. An evidence is wanted to a few hundredths, and
along a bent ridge (the excess and the speed of Stribeck friction) it changes faster than the deviance."""
_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-9
_MOST_DAMPING = 1e8
_FIRST_PERIODS = 3.0
_GROWTH = 1.7


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopFit(Point):
    """A model at the mode of its posterior: there the gradient is zero but where a bound holds a coordinate.

    Attributes
    ----------
    model : LoopModel
    noise_models : tuple of NoiseModel
        Noise of each record.
    """

    model: LoopModel
    noise_models: tuple[NoiseModel, ...]

    @property
    def centre(self) -> tuple[Array, float]:
        """Mode and objective of the second-order problem, beyond the bounds that hold a coordinate."""
        low, high = self.model.bounds
        if not np.any((self.z <= low) | (self.z >= high)):
            return self.z, self.objective
        step = cho_solve(cho_factor(self.precision), self.gradient)
        return self.z + step, self.objective - float(self.gradient @ step)

    @property
    def residuals(self) -> tuple[Array, ...]:
        """Measured minus predicted, of each record."""
        pairs = zip(self.model.segments, self.predictions, strict=True)
        return tuple(segment.values - prediction.signal for segment, prediction in pairs)

    @property
    def free_residuals(self) -> tuple[Array, ...]:
        """The same of the samples that measure noise."""
        pairs = zip(self.model.segments, self.residuals, strict=True)
        return tuple(residual[segment.free] for segment, residual in pairs)

    @property
    def covariance(self) -> Array:
        """Inverse of the precision."""
        return np.asarray(cho_solve(cho_factor(self.precision), np.eye(self.z.size)))


def fit_model(
    model: LoopModel,
    noise_models: Sequence[NoiseModel],
    start: Array,
    *,
    segments: Sequence[Segment] | None = None,
    iterations: int = _ITERATIONS,
) -> LoopFit | None:
    """Climb from a start to the mode of the posterior.

    Levenberg and Marquardt's method, with steps that end at the bounds. SciPy's ``least_squares`` does not
    fit: the objective is no sum of squares, since the noise scale is at its best at every step, outliers
    are reweighted and clipped samples censored.

    Parameters
    ----------
    model : LoopModel
    noise_models : sequence of NoiseModel
    start : ndarray, shape (p,)
    segments : sequence of Segment, optional
        Shortened records to fit instead of the model's own.
    iterations : int
        Most steps.

    Returns
    -------
    LoopFit or None
        None where the motion from the start does not stay finite.
    """
    used = tuple(model.segments if segments is None else segments)
    objective = Objective(model, tuple(noise_models), used)
    point = objective.at(start)
    if point is None:
        return None
    damping = _FIRST_DAMPING
    for _ in range(iterations):
        better, damping = _improved(objective, point, damping)
        if better is None:
            break
        point = better
        damping = max(damping / 8.0, _LEAST_DAMPING)
    return LoopFit(model=model, noise_models=objective.noise_models, **vars(point))


def _improved(objective: Objective, point: Point, damping: float) -> tuple[Point | None, float]:
    """Damp the step until it improves the objective; None once no step promises to."""
    precision, gradient = point.precision, point.gradient
    while damping < _MOST_DAMPING:
        damped = precision + damping * np.diag(np.diag(precision))
        move = _step(damped, gradient, point.z, objective.model.bounds)
        if float(gradient @ move) < _PROMISED:
            break
        trial = objective.at(point.z + move)
        if trial is not None and trial.objective < point.objective:
            return trial, damping
        damping *= 6.0
    return None, damping


def _step(precision: Array, gradient: Array, z: Array, bounds: tuple[Array, Array]) -> Array:
    """Newton's step of the coordinates that are not held at their bounds."""
    low, high = bounds
    free = ~(((z <= low) & (gradient < 0.0)) | ((z >= high) & (gradient > 0.0)))
    move = np.zeros(z.size)
    move[free] = cho_solve(cho_factor(precision[np.ix_(free, free)]), gradient[free])
    return move


def fit_growing_record(
    model: LoopModel, noise_models: Sequence[NoiseModel], start: Array, *, share: float = 0.0
) -> LoopFit | None:
    """Fit the first part of the records, then more and more of them, so that no cycle is slipped.

    Parameters
    ----------
    model : LoopModel
    noise_models : sequence of NoiseModel
    start : ndarray, shape (p,)
    share : float
        Share of the moving samples to begin with; three periods at least.
    """
    counts = [segment.values.size for segment in model.segments]
    periods = [2.0 * math.pi / (s.decay.frequency * s.decay.step) for s in model.segments]
    pairs = zip(model.segments, periods, strict=True)
    samples = [max(share * s.moving, _FIRST_PERIODS * period) for s, period in pairs]
    z = start
    while True:
        used = [min(int(n), most) for n, most in zip(samples, counts, strict=True)]
        if used == counts:
            return fit_model(model, noise_models, z)
        fit = fit_model(model, noise_models, z, segments=model.shortened(used), iterations=6)
        if fit is None:
            return None
        z = fit.z
        samples = [_GROWTH * n for n in samples]
