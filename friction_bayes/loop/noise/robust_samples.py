r"""Samples that the regression sets aside: outliers, and those near a ceiling of the sensor.

Samples are set aside by the prediction from all others. Near a ceiling the sample itself must not decide: one
just below is there because its noise was negative, so that the mean noise of those kept would be below zero,
and friction biased. Outliers are as probable on both sides, and their own values may decide.

A regression on the samples that are used has their density alone, under normal noise. So that its evidence is
one of the whole record, as every other candidate's, it takes a factor

.. math:: \prod_{\text{aside}} p(y_i) \prod_{\text{used}} \frac{p(y_i)}{N(y_i)}

with the contaminated and censored densities ``p`` of :mod:`friction_bayes.loop.noise.likelihood` about what
all other samples predict. Of samples set aside side by side the errors of prediction are taken as
independent: the motion is known between them to a fraction of the noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr
from scipy.stats import chi2

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import (
    NoiseFit,
    fit_noise,
    log_densities,
)
from friction_bayes.mechanics.effects import Scales
from friction_bayes.statespace.smoother import SmoothedMotion

__all__ = ["LeftOut", "come_anywhere"]

_PARTS = 5
"""Equal parts of the samples in which outliers are counted: few, as outliers are."""


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
