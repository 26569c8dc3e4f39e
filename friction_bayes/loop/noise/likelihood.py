"""Likelihood of residuals: white noise, normal or with outliers, censored where flat."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.mechanics.effects import EFFECTS, Scales

__all__ = ["LEAST_NOISE", "NoiseFit", "fit_noise", "log_densities"]

LEAST_NOISE = 1e-6
"""Least noise over signal amplitude of every record: ten times the integrator's error."""
_ROUNDS = 60
_SETTLED = 1e-4


@dataclass(frozen=True, eq=False)
class NoiseFit:
    """The best noise scale of residuals.

    Attributes
    ----------
    counted : ndarray of bool, shape (n,)
        Which samples count.
    core : ndarray, shape (n,)
        Probability that a sample is no outlier; one where it is held at an end of the range.
    sd : float
        Standard deviation of the core.
    log_volume : float
        Logarithm of the posterior volume and the prior density of the noise parameters, relative to the
        logarithm of ``sd`` alone.
    fraction, scale : float
        Of the outliers; zero without.
    """

    counted: Mask
    core: Array
    sd: float
    log_volume: float
    fraction: float = 0.0
    scale: float = 0.0

    @property
    def outliers(self) -> Mask:
        """Samples that are more probably outliers than not, shape (n,)."""
        return np.asarray(self.core < 0.5)


def fit_noise(
    residual: Array, sides: Array, scales: Scales, *, outliers: bool, ignored: Mask | None = None
) -> NoiseFit:
    """The best noise scale of residuals.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Measured minus predicted.
    sides : ndarray, shape (n,)
        1 and -1 where the sample is only known to lie beyond the upper and lower end of the sensor's range,
        else 0.
    scales : Scales
        Of the priors of the outliers.
    outliers : bool
        Whether a fraction of the samples has a larger scale.
    ignored : ndarray of bool, shape (n,), optional
        Samples that do not count.
    """
    flat = sides != 0.0
    usable = ~flat if ignored is None else ~(flat | ignored)
    x, core = residual[usable], np.ones(residual.size)
    if outliers:
        sd, fraction, scale, core[usable], volume = _contaminated(x, scales)
    else:
        sd = max(math.sqrt(float(x @ x) / max(x.size, 1)), LEAST_NOISE * scales.signal)
        fraction = scale = volume = 0.0
    return NoiseFit(usable | flat, core, sd, volume, fraction, scale)


def log_densities(residual: Array, sides: Array, noise: NoiseFit) -> Array:
    """Log-likelihood of each sample at the noise scale found, shape (n,); zero where it does not count."""
    flat = sides != 0.0
    out = -0.5 * (residual / noise.sd) ** 2 - math.log(noise.sd) - 0.5 * math.log(2.0 * math.pi)
    if noise.fraction > 0.0:
        wide = -0.5 * (residual / noise.scale) ** 2 - math.log(noise.scale) - 0.5 * math.log(2.0 * math.pi)
        out = np.logaddexp(math.log1p(-noise.fraction) + out, math.log(noise.fraction) + wide)
    if flat.any():
        # at the upper end (side 1) the signal lies above the level: the larger the prediction the likelier
        distance = -sides[flat] * residual[flat]
        out[flat] = log_ndtr(distance / noise.sd)
        if noise.fraction > 0.0:
            far = math.log(noise.fraction) + log_ndtr(distance / noise.scale)
            out[flat] = np.logaddexp(math.log1p(-noise.fraction) + out[flat], far)
    return np.where(noise.counted, out, 0.0)


def _contaminated(x: Array, scales: Scales) -> tuple[float, float, float, Array, float]:
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
    return sd, fraction, scale, core, volume
