"""Likelihood of residuals: white noise, normal or with outliers, censored where flat.

Every likelihood here has one form: a deviance ``-2 log L`` at the best noise scale, and for each sample a
weight and a pseudo-residual, such that ``J' w J`` and ``J' w e`` are its curvature and half its gradient.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.mechanics.effects import EFFECTS, Scales

__all__ = ["NoiseFit", "NoiseModel", "fit_noise", "has_heavy_tails", "log_densities"]


LEAST_NOISE = 1e-6
"""Least noise over signal amplitude of every record: ten times the integrator's error."""
_ROUNDS = 60
_SETTLED = 1e-4


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


@dataclass(frozen=True, eq=False)
class NoiseFit:
    """Deviance of residuals at their best noise scale.

    Attributes
    ----------
    deviance : float
        ``-2 log L``.
    weight, residual : ndarray, shape (n,)
        Weights and pseudo-residuals.
    sd : float
        Standard deviation of the core.
    log_volume : float
        Logarithm of the posterior volume and the prior density of the noise parameters, relative to the
        logarithm of ``sd`` alone.
    fraction, scale : float
        Of the outliers; zero without.
    """

    deviance: float
    weight: Array
    residual: Array
    sd: float
    log_volume: float
    fraction: float = 0.0
    scale: float = 0.0


def fit_noise(
    residual: Array, sides: Array, noise_model: NoiseModel, scales: Scales, ignored: Mask | None = None
) -> NoiseFit:
    """The best noise scale of residuals, and the weight of each sample under it.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Measured minus predicted.
    sides : ndarray, shape (n,)
        1 and -1 where the sample lies flat at the upper and lower end of the sensor's range, else 0.
    noise_model : NoiseModel
    scales : Scales
        Of the priors of the outliers.
    ignored : ndarray of bool, shape (n,), optional
        Samples that do not count.
    """
    flat = (sides != 0.0) if noise_model.censored else np.zeros(sides.size, dtype=bool)
    unknown = flat if ignored is None else flat | ignored
    usable = ~unknown
    x = residual[usable]
    weight = np.zeros(residual.size)
    if noise_model.outliers:
        deviance, sd, fraction, scale, core, volume = _contaminated(x, scales)
        weight[usable] = core / sd**2 + (1.0 - core) / scale**2
    else:
        square = float(x @ x)
        sd = max(math.sqrt(square / max(x.size, 1)), LEAST_NOISE * scales.signal)
        fraction = scale = volume = 0.0
        deviance = x.size * math.log(2.0 * math.pi * sd * sd) + square / sd**2
        weight[usable] = 1.0 / sd**2
    if flat.any():
        # at the upper end (side 1) the signal lies above the level: the larger the prediction the likelier
        side = sides[flat]
        log_p, hazard, curve = _beyond(-side * residual[flat], sd, fraction, scale)
        deviance -= 2.0 * float(log_p.sum())
        weight[flat] = curve
        residual = residual.copy()
        residual[flat] = side * hazard / curve
    return NoiseFit(deviance, weight, residual, sd, volume, fraction, scale)


def log_densities(residual: Array, sides: Array, noise_model: NoiseModel, noise: NoiseFit) -> Array:
    """Log-likelihood of each sample at the noise scale found, shape (n,); zero where it does not count."""
    counted = noise.weight > 0.0
    flat = counted & (sides != 0.0) if noise_model.censored else np.zeros(sides.size, dtype=bool)
    out = -0.5 * (residual / noise.sd) ** 2 - math.log(noise.sd) - 0.5 * math.log(2.0 * math.pi)
    if noise.fraction > 0.0:
        wide = -0.5 * (residual / noise.scale) ** 2 - math.log(noise.scale) - 0.5 * math.log(2.0 * math.pi)
        out = np.logaddexp(math.log1p(-noise.fraction) + out, math.log(noise.fraction) + wide)
    if flat.any():
        out[flat] = _beyond(-sides[flat] * residual[flat], noise.sd, noise.fraction, noise.scale)[0]
    return np.where(counted, out, 0.0)


def _beyond(distance: Array, sd: float, fraction: float, scale: float) -> tuple[Array, Array, Array]:
    """Log-probability that a signal predicted ``distance`` beyond the level is held, slope, curvature."""
    z = distance / sd
    log_p = log_ndtr(z)
    log_density = -0.5 * z * z - 0.5 * math.log(2.0 * math.pi) - math.log(sd)
    if fraction > 0.0:
        wide = distance / scale
        log_p = np.logaddexp(math.log1p(-fraction) + log_p, math.log(fraction) + log_ndtr(wide))
        far = -0.5 * wide * wide - 0.5 * math.log(2.0 * math.pi) - math.log(scale)
        log_density = np.logaddexp(math.log1p(-fraction) + log_density, math.log(fraction) + far)
    hazard = np.exp(log_density - log_p)
    # of one normal the curvature is hazard (hazard + z / sd); of two it may turn negative and is left out
    curve = hazard * (hazard + z / sd) if fraction == 0.0 else hazard * hazard
    return log_p, hazard, np.maximum(curve, 1e-12 / sd**2)


def _contaminated(x: Array, scales: Scales) -> tuple[float, float, float, float, Array, float]:
    """Expectation-maximisation of a contaminated normal, the catalogue's priors on fraction and scale."""
    fraction_prior, scale_prior = EFFECTS["outliers"].priors(scales)
    square = x * x
    least = LEAST_NOISE * scales.signal
    sd = max(1.4826 * float(np.median(np.abs(x))), least)
    far = square > (settings.SETTINGS.far * sd) ** 2
    fraction = max(float(far.mean()), 1.0 / x.size)
    scale = math.sqrt(float(square[far].mean())) if far.any() else 6.0 * sd
    last = math.inf
    deviance, core = math.inf, np.ones(x.size)
    for _ in range(_ROUNDS):
        near = math.log1p(-fraction) - math.log(sd) - 0.5 * square / sd**2
        wide = math.log(fraction) - math.log(scale) - 0.5 * square / scale**2
        both = np.logaddexp(near, wide)
        core = np.exp(near - both)
        deviance = -2.0 * float(both.sum()) + x.size * math.log(2.0 * math.pi)
        if last - deviance < _SETTLED:
            break
        last = deviance
        outside = max(float(np.sum(1.0 - core)), 0.5)
        fraction = min(outside / x.size, 0.5)
        sd = max(math.sqrt(float(core @ square) / float(core.sum())), least)
        scale = max(math.sqrt(float((1.0 - core) @ square) / outside), 1.5 * sd)
    count = max(fraction * x.size, 1.0)
    # curvature of the log-likelihood: binomial in the fraction, normal in the logarithm of the scale
    volume = math.log(2.0 * math.pi) + 0.5 * math.log(fraction * (1.0 - fraction) / x.size)
    volume += 0.5 * math.log(1.0 / (2.0 * count)) + math.log(scale)
    volume += float(fraction_prior.log_density(fraction) + scale_prior.log_density(scale))
    return deviance, sd, fraction, scale, core, volume


def has_heavy_tails(x: Array) -> bool:
    """Whether more residuals are far out than under a normal distribution."""
    core = 1.4826 * float(np.median(np.abs(x)))
    expected = 2.0 * float(ndtr(-settings.SETTINGS.far)) * x.size
    far = np.count_nonzero(np.abs(x) > settings.SETTINGS.far * core)
    return bool(far > expected + 3.0 * math.sqrt(expected) + 1.0)
