"""What a fit minimises: minus twice the log-posterior of a model, at the best noise scale of each record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel, Prediction
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import NoiseFit, NoiseModel, fit_noise, whiten
from friction_bayes.loop.search.derivatives import predict_with_derivatives

__all__ = ["Objective", "Point"]

_ROUNDING = 1e-12
"""Added to the prior precision, so that flat priors leave a matrix that can be factored."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Point:
    """The objective to second order about one vector of coordinates (Gauss and Newton).

    Attributes
    ----------
    z : ndarray, shape (p,)
    predictions : tuple of Prediction
    noises : tuple of NoiseFit
    jacobians : tuple of ndarray, shape (n, p)
        Whitened derivatives of the signal of each record.
    precision : ndarray, shape (p, p)
        Curvature of half the objective.
    gradient : ndarray, shape (p,)
        Minus the gradient of half the objective.
    deviance, objective : float
    """

    z: Array
    predictions: tuple[Prediction, ...]
    noises: tuple[NoiseFit, ...]
    jacobians: tuple[Array, ...]
    precision: Array
    gradient: Array
    deviance: float
    objective: float


@dataclass(frozen=True, eq=False)
class Objective:
    """The objective of a model under given noise.

    Parameters
    ----------
    model : LoopModel
    noise_models : tuple of NoiseModel
        Noise of each record.
    segments : tuple of Segment
        The samples that are fitted: those of the model, or the first of them.
    """

    model: LoopModel
    noise_models: tuple[NoiseModel, ...]
    segments: tuple[Segment, ...]

    @cached_property
    def prior_precision(self) -> Array:
        """Prior precision of each coordinate, shape (p,)."""
        return np.array([c.precision for c in self.model.coordinates])

    def at(self, z: Array) -> Point | None:
        """Evaluate; None where the motion does not stay finite. Coordinates are moved within their bounds."""
        z = self.model.within_bounds(z)
        predictions, noises, jacobians = [], [], []
        precision = np.diag(self.prior_precision + _ROUNDING)
        gradient = -self.prior_precision * z
        for r, (segment, noise_model) in enumerate(zip(self.segments, self.noise_models, strict=True)):
            predicted = predict_with_derivatives(self.model, z, r, segment.time)
            if predicted is None:
                return None
            prediction, derivatives = predicted
            residual = segment.values - prediction.signal
            noise = fit_noise(residual, segment.sides, noise_model, self.model.scales, segment.ignored)
            jacobian = whiten(derivatives, noise_model.ar)
            weighted = jacobian * noise.weight[:, None]
            precision += weighted.T @ jacobian
            gradient += weighted.T @ noise.residual
            predictions.append(prediction)
            noises.append(noise)
            jacobians.append(jacobian)
        deviance = math.fsum(noise.deviance for noise in noises)
        return Point(
            z=z,
            predictions=tuple(predictions),
            noises=tuple(noises),
            jacobians=tuple(jacobians),
            precision=precision,
            gradient=gradient,
            deviance=deviance,
            objective=deviance + float(self.prior_precision @ (z * z)),
        )
