"""Fit a loop model with any effects to whole signals: Levenberg and Marquardt on its posterior."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from experiments.simulation.coordinates import bounds_of
from experiments.simulation.objective import Curvature, NoiseModel, Objective, Point
from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction, difference_steps
from friction_bayes.loop.noise.likelihood import NoiseFit

__all__ = ["LoopFit", "fit_model", "settle"]

_ITERATIONS = 25
_SETTLED = 0.02
"""Change of the deviance that ends a fit; an evidence is wanted to a few hundredths."""
_PROMISED = 0.25 * _SETTLED
"""Least predicted fall of the deviance for a step to be tried."""
_PROMISED_AT_LAST = 0.1 * _PROMISED
"""The same where an evidence is needed: along a flat ridge it changes faster than the deviance."""
_NEAR = 0.1
"""Squared length of a step, in posterior standard deviations, over which the derivatives stay the same."""
_FIRST_DAMPING = 1e-3
_LEAST_DAMPING = 1e-9
_MOST_DAMPING = 1e8


@dataclass(frozen=True, eq=False)
class LoopFit:
    """A model at the mode of its posterior.

    Attributes
    ----------
    model : LoopModel
    noise_models : tuple of NoiseModel
        Noise of each record.
    z : ndarray, shape (p,)
        The mode.
    predictions : tuple of Prediction
    noises : tuple of NoiseFit
    jacobians : tuple of ndarray, shape (n, p)
        Whitened derivatives.
    precision : ndarray, shape (p, p)
        Curvature of half the objective.
    gradient : ndarray, shape (p,)
        Minus the gradient of half the objective: zero but where a bound holds a coordinate.
    deviance : float
        ``-2 log L`` at the mode.
    objective : float
        The same with the prior.
    """

    model: LoopModel
    noise_models: tuple[NoiseModel, ...]
    z: Array
    predictions: tuple[Prediction, ...]
    noises: tuple[NoiseFit, ...]
    jacobians: tuple[Array, ...]
    precision: Array
    gradient: Array
    deviance: float
    objective: float

    @property
    def centre(self) -> tuple[Array, float]:
        """Mode and objective of the second-order problem, beyond the bounds that hold a coordinate."""
        low, high = bounds_of(self.model)
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
) -> LoopFit | None:
    """The fit at the mode of the posterior, climbed to from a start.

    Levenberg and Marquardt's method, with steps that end at the bounds. SciPy's ``least_squares`` does not
    fit: the objective is no sum of squares, since the noise scale is at its best at every step, outliers
    are reweighted and clipped samples censored. Where it would fit, with white noise, it takes 1.5 to 7
    times as many simulations: derivatives cost one a parameter, and here they are taken again only after a
    step over which they change.

    Parameters
    ----------
    model : LoopModel
    noise_models : sequence of NoiseModel
    start : ndarray, shape (p,)

    Returns
    -------
    LoopFit or None
        None where the motion from the start does not stay finite.
    """
    objective = Objective(model, tuple(noise_models))
    point = objective.at(start)
    if point is None:
        return None
    damping = _FIRST_DAMPING
    steps = None
    curvature = objective.curvature(point, steps)
    for _ in range(_ITERATIONS):
        better, move, damping = _improved(objective, point, curvature, damping)
        if better is None:
            break
        gain = point.objective - better.objective
        near = float(move @ curvature.precision @ move) < _NEAR
        point = better
        damping = max(damping / 8.0, _LEAST_DAMPING)
        if near and gain < _SETTLED:
            break
        steps = difference_steps(curvature.precision)
        curvature = objective.curvature(point, steps, curvature.jacobians if near else None)
    # the last point with the last derivatives
    return _at(objective, point, objective.curvature(point, steps, curvature.jacobians))


def settle(fit: LoopFit) -> LoopFit:
    """The fit climbed on with derivatives at every point, the last one too, until they predict no gain.

    A climb ends with the derivatives of a point near its last. Where the posterior is a bent ridge (the
    excess and the speed of Stribeck friction) these may promise nothing before the top, and the evidence
    depends on where they were taken.

    Parameters
    ----------
    fit : LoopFit
    """
    objective = Objective(fit.model, fit.noise_models)
    point = Point(fit.z, fit.predictions, fit.noises, fit.deviance, fit.objective)
    curvature = objective.curvature(point, difference_steps(fit.precision))
    damping = _LEAST_DAMPING
    for _ in range(_ITERATIONS):
        move = _step(curvature.precision, curvature.gradient, point.z, bounds_of(fit.model))
        if float(curvature.gradient @ move) < _PROMISED_AT_LAST:
            break
        better, _, damping = _improved(objective, point, curvature, damping, _PROMISED_AT_LAST)
        if better is None:
            break
        point = better
        damping = max(damping / 8.0, _LEAST_DAMPING)
        curvature = objective.curvature(point, difference_steps(curvature.precision))
    return _at(objective, point, curvature)


def _at(objective: Objective, point: Point, curvature: Curvature) -> LoopFit:
    """The fit that ends at a point."""
    return LoopFit(
        model=objective.model,
        noise_models=objective.noise_models,
        z=point.z,
        predictions=point.predictions,
        noises=point.noises,
        jacobians=curvature.jacobians,
        precision=curvature.precision,
        gradient=curvature.gradient,
        deviance=point.deviance,
        objective=point.objective,
    )


def _improved(
    objective: Objective, point: Point, curvature: Curvature, damping: float, promised: float = _PROMISED
) -> tuple[Point | None, Array, float]:
    """The point of a damped step that improves the objective; None when no step is predicted to."""
    precision, gradient = curvature.precision, curvature.gradient
    move = np.zeros_like(point.z)
    while damping < _MOST_DAMPING:
        damped = precision + damping * np.diag(np.diag(precision))
        move = _step(damped, gradient, point.z, bounds_of(objective.model))
        trial = objective.at(point.z + move)
        if trial is not None and trial.objective < point.objective:
            return trial, move, damping
        damping *= 6.0
        if float(gradient @ move) < promised:
            break
    return None, move, damping


def _step(precision: Array, gradient: Array, z: Array, bounds: tuple[Array, Array]) -> Array:
    """Newton's step of the coordinates that are not at their bounds."""
    low, high = bounds
    free = ~(((z <= low) & (gradient < 0.0)) | ((z >= high) & (gradient > 0.0)))
    move = np.zeros(z.size)
    move[free] = cho_solve(cho_factor(precision[np.ix_(free, free)]), gradient[free])
    return move
