"""The objective of a fit: minus twice the log-posterior of a model at the best noise scale of each record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from experiments.simulation.coordinates import bounds_of, prior_precision
from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction, prediction_derivatives
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import NoiseFit, fit_noise, log_densities
from friction_bayes.mechanics.effects import Scales

__all__ = ["Curvature", "NoiseModel", "Objective", "Point", "pseudo_residuals"]

_ROUNDING = 1e-12
"""Added to the prior precision, so that flat priors leave a matrix that can be factored."""


@dataclass(frozen=True)
class NoiseModel:
    """The noise that is assumed of one record.

    Attributes
    ----------
    outliers : bool
        Whether a fraction of the samples has a larger scale.
    censored : bool
        Whether flat samples are only known to lie beyond the level.
    """

    outliers: bool = False
    censored: bool = False

    def sides(self, segment: Segment) -> Array:
        """Ends of the range beyond which samples are only known to lie, shape (n,); zero of the others."""
        return segment.sides if self.censored else np.zeros_like(segment.sides)

    def fit(self, residual: Array, segment: Segment, scales: Scales) -> NoiseFit:
        """The best noise scale of residuals, shape (n,)."""
        sides = self.sides(segment)
        return fit_noise(residual, sides, scales, outliers=self.outliers, ignored=segment.ignored)

    def log_densities(self, residual: Array, segment: Segment, noise: NoiseFit) -> Array:
        """Log-likelihood of each sample, shape (n,)."""
        return log_densities(residual, self.sides(segment), noise)


def pseudo_residuals(residual: Array, sides: Array, noise: NoiseFit) -> tuple[Array, Array]:
    """Weights and pseudo-residuals, shape (n,) each.

    ``J' w J`` and ``J' w e`` are the curvature of half the deviance, and minus half its gradient.
    """
    flat, sd, fraction, scale = sides != 0.0, noise.sd, noise.fraction, noise.scale
    weight = noise.core / sd**2
    if fraction > 0.0:
        weight += (1.0 - noise.core) / scale**2
    weight[~noise.counted] = 0.0
    if not flat.any():
        return weight, residual
    # at the upper end (side 1) the signal lies above the level: the larger the prediction the likelier
    z = -sides[flat] * residual[flat] / sd
    log_p, log_density = log_ndtr(z), -0.5 * z * z - 0.5 * math.log(2.0 * math.pi) - math.log(sd)
    if fraction > 0.0:
        wide = z * sd / scale
        log_p = np.logaddexp(math.log1p(-fraction) + log_p, math.log(fraction) + log_ndtr(wide))
        far = -0.5 * wide * wide - 0.5 * math.log(2.0 * math.pi) - math.log(scale)
        log_density = np.logaddexp(math.log1p(-fraction) + log_density, math.log(fraction) + far)
    hazard = np.exp(log_density - log_p)
    # of one normal the curvature is hazard (hazard + z / sd); of two it may turn negative and is left out
    curve = hazard * (hazard + z / sd) if fraction == 0.0 else hazard * hazard
    weight[flat], residual = np.maximum(curve, 1e-12 / sd**2), residual.copy()
    residual[flat] = sides[flat] * hazard / weight[flat]
    return weight, residual


@dataclass(frozen=True, eq=False)
class Point:
    """The objective at one vector of coordinates, and its parts."""

    z: Array
    predictions: tuple[Prediction, ...]
    noises: tuple[NoiseFit, ...]
    deviance: float
    objective: float


class Curvature(NamedTuple):
    """The objective to second order about a point (Gauss and Newton).

    Attributes
    ----------
    jacobians : tuple of ndarray, shape (n, p)
        Whitened derivatives of the signal of each record.
    precision : ndarray, shape (p, p)
        Curvature of half the objective.
    gradient : ndarray, shape (p,)
        Minus the gradient of half the objective.
    """

    jacobians: tuple[Array, ...]
    precision: Array
    gradient: Array


@dataclass(frozen=True, eq=False)
class Objective:
    """The objective of a model under given noise.

    Parameters
    ----------
    model : LoopModel
    noise_models : tuple of NoiseModel
        Noise of each record.
    """

    model: LoopModel
    noise_models: tuple[NoiseModel, ...]

    def at(self, z: Array) -> Point | None:
        """The objective; None where the motion is not finite. Coordinates are moved within their bounds."""
        z = np.clip(z, *bounds_of(self.model))
        predictions, noises, densities = [], [], []
        for r, segment in enumerate(self.model.segments):
            prediction = self.model.predict(z, r)
            if prediction is None:
                return None
            residual = segment.values - prediction.signal
            predictions.append(prediction)
            noises.append(self.noise_models[r].fit(residual, segment, self.model.scales))
            densities.append(self.noise_models[r].log_densities(residual, segment, noises[-1]))
        deviance = -2.0 * math.fsum(float(each.sum()) for each in densities)
        objective = deviance + float(prior_precision(self.model) @ (z * z))
        return Point(z, tuple(predictions), tuple(noises), deviance, objective)

    def curvature(self, point: Point, steps: Array | None, known: Sequence[Array] | None = None) -> Curvature:
        """Expansion about a point, by difference ``steps`` or with derivatives ``known`` already."""
        precision = np.diag(prior_precision(self.model) + _ROUNDING)
        gradient = -prior_precision(self.model) * point.z
        jacobians = []
        for r, segment in enumerate(self.model.segments):
            if known is None:
                jacobian = prediction_derivatives(self.model, point.z, r, point.predictions[r], steps)
            else:
                jacobian = known[r]
            residual = segment.values - point.predictions[r].signal
            sides = self.noise_models[r].sides(segment)
            weight, pseudo = pseudo_residuals(residual, sides, point.noises[r])
            weighted = jacobian * weight[:, None]
            precision += weighted.T @ jacobian
            gradient += weighted.T @ pseudo
            jacobians.append(jacobian)
        return Curvature(tuple(jacobians), precision, gradient)
