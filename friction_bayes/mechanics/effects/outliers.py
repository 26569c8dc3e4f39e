"""Noise of which a fraction comes from a normal distribution of another, larger scale."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.effects.effect import NoiseEffect, Parameter
from friction_bayes.mechanics.effects.prior import half_normal, log_normal

__all__ = ["OUTLIERS"]


class _ContaminatedNoise(NoiseEffect):
    def contaminate(
        self, noise: Array, signal: Array, rate: Array, rng: np.random.Generator, *values: float
    ) -> Array:
        fraction, scale = values
        hit = rng.random(noise.size) < fraction
        return np.where(hit, rng.normal(0.0, scale, noise.size), noise)


OUTLIERS = _ContaminatedNoise(
    name="outliers",
    summary="a fraction of the noise samples has standard deviation scale",
    parameters=(
        Parameter(name="fraction", unit="1", low=0.0, high=1.0, prior=lambda scales: half_normal(0.05, 1.0)),
        Parameter(
            name="scale",
            unit="signal",
            low=0.0,
            open_low=True,
            prior=lambda scales: log_normal(0.3 * scales.signal, 1.0),
        ),
    ),
)
