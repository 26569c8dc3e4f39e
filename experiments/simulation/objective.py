"""The objective of a fit: minus twice the log-posterior of a model at the best noise scale of each record."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction
from friction_bayes.loop.data.prediction_derivatives import prediction_derivatives
from friction_bayes.loop.noise.likelihood import NoiseFit, NoiseModel, fit_noise

__all__ = ["Curvature", "Objective", "Point"]

_ROUNDING = 1e-12
"""Added to the prior precision, so that flat priors leave a matrix that can be factored."""


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
        z = self.model.within_bounds(z)
        predictions, noises = [], []
        for r, segment in enumerate(self.model.segments):
            prediction = self.model.predict(z, r)
            if prediction is None:
                return None
            residual = segment.values - prediction.signal
            predictions.append(prediction)
            noises.append(
                fit_noise(residual, segment.sides, self.noise_models[r], self.model.scales, segment.ignored)
            )
        deviance = math.fsum(noise.deviance for noise in noises)
        objective = deviance + float(self.model.prior_precision @ (z * z))
        return Point(z, tuple(predictions), tuple(noises), deviance, objective)

    def curvature(self, point: Point, steps: Array | None, known: Sequence[Array] | None = None) -> Curvature:
        """Expansion about a point, by difference ``steps`` or with derivatives ``known`` already."""
        precision = np.diag(self.model.prior_precision + _ROUNDING)
        gradient = -self.model.prior_precision * point.z
        jacobians = []
        for r in range(len(self.model.segments)):
            if known is None:
                jacobian = prediction_derivatives(self.model, point.z, r, point.predictions[r], steps)
            else:
                jacobian = known[r]
            noise = point.noises[r]
            weighted = jacobian * noise.weight[:, None]
            precision += weighted.T @ jacobian
            gradient += weighted.T @ noise.residual
            jacobians.append(jacobian)
        return Curvature(tuple(jacobians), precision, gradient)
