r"""Likelihood of residuals, normal or with outliers, censored where flat, and the samples set aside for it.

Samples are set aside by the prediction from all others. Near a ceiling the sample itself must not decide: one
just below is there because its noise was negative, so that the mean noise of those kept would be below zero,
and friction biased. Outliers are as probable on both sides, and their own values may decide.

A regression on the samples that are used has their density alone, under normal noise. So that its evidence is
one of the whole record, as every other candidate's, it takes a factor

.. math:: \prod_{\text{aside}} p(y_i) \prod_{\text{used}} \frac{p(y_i)}{N(y_i)}

with the contaminated and censored densities ``p`` about what all other samples predict. Of samples set aside
side by side the errors of prediction are taken as independent: the motion is known between them to a fraction
of the noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr, ndtr
from scipy.stats import chi2

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.mechanics.effects import EFFECTS, Scales
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["LEAST_NOISE", "LeftOut", "NoiseFit", "come_anywhere", "fit_noise", "log_densities"]

LEAST_NOISE = 1e-6
"""Least noise over signal amplitude of every record: ten times the integrator's error."""
_ROUNDS = 60
_SETTLED = 1e-4
_PARTS = 5
"""Equal parts of the samples in which outliers are counted: few, as outliers are."""


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
    """The best noise scale of residuals, shape (n,), without the samples ``ignored``.

    A sample is known to lie beyond the upper or lower end of the sensor's range alone where its side is 1 or
    -1 instead of 0. With ``outliers``, whose priors are scaled, a fraction of the samples has a larger scale.
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


@dataclass(frozen=True, kw_only=True, eq=False)
class LeftOut:
    """The samples of a record, with the prediction of each from all others.

    Attributes
    ----------
    segment : Segment
        The samples, and which of them the sensor holds at an end of its range.
    scales : Scales
        Of the priors.
    error : ndarray, shape (n,)
        Sample less prediction, unit of the signal.
    variance : ndarray, shape (n,)
        Of these errors, in units of the variance of the noise.
    """

    segment: Segment
    scales: Scales
    error: Array
    variance: Array

    @property
    def sides(self) -> Array:
        """Ends of the range at which samples are held, shape (n,), see :class:`Segment`."""
        return self.segment.sides[: self.error.size]

    @property
    def standardised(self) -> Array:
        """The errors, each as large as noise alone would make it, shape (n,)."""
        return np.asarray(self.error / np.sqrt(self.variance))

    def noise(self, *, outliers: bool) -> NoiseFit:
        """Scale of the noise, and which samples are outliers under it."""
        ignored = self.segment.ignored[: self.error.size]
        return fit_noise(self.standardised, self.sides, self.scales, outliers=outliers, ignored=ignored)

    def heavy_tails(self, among: Mask) -> bool:
        """Whether more errors of some samples are far out than under a normal distribution."""
        size = np.abs(self.standardised[among])
        core = 1.4826 * float(np.median(size))
        expected = 2.0 * float(ndtr(-settings.SETTINGS.far)) * size.size
        far = np.count_nonzero(size > settings.SETTINGS.far * core)
        return bool(far > expected + 3.0 * math.sqrt(expected) + 1.0)

    def near_ceiling(self, noise: NoiseFit) -> Mask:
        """Samples that are held at an end of the range or that noise may have taken there, shape (n,)."""
        values = self.segment.values[: self.error.size]
        near = self.sides != 0.0
        margin = settings.SETTINGS.far * noise.sd * np.sqrt(self.variance)
        for side in (1.0, -1.0):
            held = self.sides == side
            if held.any():
                near |= side * (values - self.error) > np.min(side * values[held]) - margin
        return near

    def log_factor(self, used: Mask, *, outliers: bool) -> float:
        """Logarithm of the factor above; the prior of the outliers' fraction and scale included."""
        error, sides, noise = self.standardised, self.sides, self.noise(outliers=outliers)
        density = log_densities(error, sides, noise)
        normal = log_densities(error, np.zeros_like(sides), replace(noise, fraction=0.0))
        # the density of an error, where that of the standardised one is known
        stretched = ~used & self.segment.free[: error.size]
        density[stretched] -= 0.5 * np.log(self.variance[stretched])
        return float(density.sum() - normal[used].sum()) + noise.log_volume


def come_anywhere(outliers: Mask, among: Mask, motion: SmoothedMotion) -> bool:
    """Whether outliers are as frequent at any speed and at any time, ``among`` some samples; shape (n,) both.

    Those of a sensor are. Those at turning points, or in one part of the record, are due to an error of the
    law or the force: with them set aside, the interval of friction would be far too narrow.
    """
    in_turn, speed = outliers[among], np.abs(motion.states[among, 1])
    return all(_evenly(values) for values in (in_turn, in_turn[np.argsort(speed)]))


def _evenly(outliers: Mask) -> bool:
    """Whether equal parts of samples in a row contain as many each as expected by chance."""
    counts = np.array([part.sum() for part in np.array_split(outliers, _PARTS)])
    total = int(counts.sum())
    if total == 0:
        return True
    expected = total / _PARTS
    statistic = float(np.sum((counts - expected) ** 2) / (expected * (1.0 - total / (outliers.size + 1))))
    return bool(chi2.sf(statistic, _PARTS - 1) > settings.SETTINGS.noise_alarm_rate)
