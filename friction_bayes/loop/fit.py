"""Fit a loop model to whole signals: Levenberg and Marquardt on the posterior of a growing record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from friction_bayes.core.arrays import Array
from friction_bayes.loop.model import LoopModel, Prediction
from friction_bayes.loop.noise import NoiseFit, NoiseModel, fit_noise, whiten
from friction_bayes.loop.segment import Segment

__all__ = ["LoopFit", "fit_growing_record", "fit_model", "starting_point"]

_ITERATIONS = 25
_SETTLED = 0.02
"""Change of the deviance that ends a fit; an evidence is wanted to a few hundredths."""
_NEAR = 0.1
"""Squared length of a step, in posterior standard deviations, over which the derivatives stay the same."""
_STEP_SHARE = 0.2
"""Difference step in posterior standard deviations: far above rounding, far below curvature."""
_FIRST_PERIODS = 3.0
_GROWTH = 1.7


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
        Minus the gradient of half the objective: nothing but where a coordinate is held at its bounds.
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
        """The same without samples held at an end of the sensor's range, which measure no noise."""
        pairs = zip(self.model.segments, self.residuals, strict=True)
        return tuple(residual[segment.sides == 0.0] for segment, residual in pairs)

    @property
    def covariance(self) -> Array:
        """Inverse of the precision."""
        return np.asarray(cho_solve(cho_factor(self.precision), np.eye(self.z.size)))


@dataclass(frozen=True, eq=False)
class _Point:
    z: Array
    predictions: tuple[Prediction, ...]
    noises: tuple[NoiseFit, ...]
    deviance: float
    objective: float


def starting_point(model: LoopModel) -> Array:
    """Rough coordinates of the Coulomb model from what was found when the records were cut."""
    decay = model.segments[0].decay
    w0 = model.system.natural_frequency
    drops = []
    states = []
    for segment in model.segments:
        d = segment.decay
        half = max(int(math.pi / (d.frequency * d.step)), 2)
        unit = d.frequency**segment.order
        y = (d.values - d.rest_position) / unit
        first, last = (float(np.quantile(np.abs(part), 0.97)) for part in (y[: 2 * half], y[-2 * half :]))
        halves = max(d.values.size / half - 2.0, 1.0)
        drops.append(max(first - last, 0.02 * first) / (2.0 * halves))
        amplitude = float(np.sqrt(2.0 * np.mean(y[: 2 * half] ** 2)))
        states += [amplitude * math.cos(d.phase), -amplitude * d.frequency * math.sin(d.phase)]
    ratio = math.log(decay.frequency / w0)
    friction = float(np.median(drops)) * model.system.stiffness
    values = [friction, ratio, *states]
    z = np.array([c.start for c in model.coordinates])
    z[: len(values)] = [c.coordinate(v) for c, v in zip(model.coordinates, values, strict=False)]
    return model.within_bounds(z)


def fit_model(
    model: LoopModel,
    noise_models: Sequence[NoiseModel],
    start: Array,
    *,
    segments: Sequence[Segment] | None = None,
    iterations: int = _ITERATIONS,
    steps: Array | None = None,
) -> LoopFit | None:
    """Climb from a start to the mode of the posterior.

    Parameters
    ----------
    model : LoopModel
    noise_models : sequence of NoiseModel
    start : ndarray, shape (p,)
    segments : sequence of Segment, optional
        Shortened records to fit instead of the model's own.
    iterations : int
        Most steps.
    steps : ndarray, shape (p,), optional
        Difference steps.

    Returns
    -------
    LoopFit or None
        None where the motion from the start does not stay finite.
    """
    used = tuple(model.segments if segments is None else segments)
    prior = np.array([c.precision for c in model.coordinates])
    point = _evaluate(model, noise_models, model.within_bounds(start), used, prior)
    if point is None:
        return None
    bounds = model.bounds
    damping = 1e-3
    jacobians, precision, gradient = _linearise(model, noise_models, point, used, prior, steps)
    for _ in range(iterations):
        improved = None
        length = 0.0
        while damping < 1e8:
            damped = precision + damping * np.diag(np.diag(precision))
            move = _step(damped, gradient, point.z, bounds)
            trial = _evaluate(model, noise_models, model.within_bounds(point.z + move), used, prior)
            if trial is not None and trial.objective < point.objective:
                improved = trial
                length = float(move @ precision @ move)
                break
            damping *= 6.0
            expected = float(gradient @ move)
            if expected < 0.25 * _SETTLED:
                break
        if improved is None:
            break
        gain = point.objective - improved.objective
        point = improved
        damping = max(damping / 8.0, 1e-9)
        near = length < _NEAR
        if near and gain < _SETTLED:
            break
        steps = _difference_steps(precision)
        jacobians, precision, gradient = _linearise(
            model, noise_models, point, used, prior, steps, jacobians if near else None
        )
    _, precision, gradient = _linearise(model, noise_models, point, used, prior, steps, jacobians)
    return LoopFit(
        model,
        tuple(noise_models),
        point.z,
        point.predictions,
        point.noises,
        jacobians,
        precision,
        gradient,
        point.deviance,
        point.objective,
    )


def _step(curvature: Array, gradient: Array, z: Array, bounds: tuple[Array, Array]) -> Array:
    """Newton's step of the coordinates that are not held at their bounds."""
    low, high = bounds
    free = ~(((z <= low) & (gradient < 0.0)) | ((z >= high) & (gradient > 0.0)))
    move = np.zeros(z.size)
    move[free] = cho_solve(cho_factor(curvature[np.ix_(free, free)]), gradient[free])
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


def _evaluate(
    model: LoopModel, noise_models: Sequence[NoiseModel], z: Array, segments: Sequence[Segment], prior: Array
) -> _Point | None:
    predictions, noises = [], []
    for r, segment in enumerate(segments):
        prediction = model.predict(z, r, segment)
        if prediction is None:
            return None
        predictions.append(prediction)
        noises.append(
            fit_noise(segment.values - prediction.signal, segment.sides, noise_models[r], model.scales)
        )
    deviance = math.fsum(noise.deviance for noise in noises)
    return _Point(z, tuple(predictions), tuple(noises), deviance, deviance + float(prior @ (z * z)))


def _linearise(
    model: LoopModel,
    noise_models: Sequence[NoiseModel],
    point: _Point,
    segments: Sequence[Segment],
    prior: Array,
    steps: Array | None,
    known: Sequence[Array] | None = None,
) -> tuple[tuple[Array, ...], Array, Array]:
    """Derivatives (the ``known`` ones where given), precision and gradient at a point."""
    precision = np.diag(prior + 1e-12)
    gradient = -prior * point.z
    jacobians = []
    for r, segment in enumerate(segments):
        if known is None:
            raw = model.derivatives(point.z, r, point.predictions[r], steps, segment)
            jacobian = whiten(raw, noise_models[r].ar)
        else:
            jacobian = known[r]
        noise = point.noises[r]
        weighted = jacobian * noise.weight[:, None]
        precision += weighted.T @ jacobian
        gradient += weighted.T @ noise.residual
        jacobians.append(jacobian)
    return tuple(jacobians), precision, gradient


def _difference_steps(precision: Array) -> Array:
    """A share of each coordinate's standard deviation with the others held, within sane bounds."""
    return np.clip(_STEP_SHARE / np.sqrt(np.diag(precision)), 1e-7, 1e-2)
