"""Tests of whether residuals are white and normal, and the p-values of all tests of a fit together.

Textbook tests: Ljung-Box, the largest line of a periodogram, the count of far residuals. All p-values are
corrected for the number of tests.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.loop import settings
from friction_bayes.loop.infer.coulomb_fit import CoulombFit
from friction_bayes.loop.noise.likelihood import LEAST_NOISE

__all__ = ["Channel", "ResidualTests", "noise_tests", "tests_before", "worst_of"]


_FEWEST_FOR_A_LINE = 4
"""Samples that have a frequency between zero and Nyquist's: of a record that clips none may be left."""


@dataclass(frozen=True)
class Channel:
    """One test: its degrees of freedom, or samples of a count, and its p-value before correction."""

    name: str
    statistic: float
    degrees: int
    p_value: float


@dataclass(frozen=True)
class ResidualTests:
    """All tests of a fit, and the rms of its residual within the range of the sensor, unit of the signal."""

    channels: tuple[Channel, ...]
    rms: float

    @property
    def failed(self) -> tuple[str, ...]:
        """Names of the channels that fail."""
        level = settings.SETTINGS.false_alarm_rate / max(len(self.channels), 1)
        return tuple(c.name for c in self.channels if c.p_value < level)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "rms": self.rms,
            "passes": not self.failed,
            "failed": list(self.failed),
            "false_alarm_rate": settings.SETTINGS.false_alarm_rate,
            "channels": {
                c.name: {"statistic": c.statistic, "degrees": c.degrees, "p_value": c.p_value}
                for c in self.channels
            },
        }


def noise_tests(x: Array) -> tuple[Channel, ...]:
    """Tests of correlation, of the largest line, and of samples far out; of residuals over their sd."""
    white, (line, p_value) = whiteness(x), _largest_line(x)
    return (
        Channel("whiteness", white.statistic, white.lags, white.p_value),
        Channel("spectrum", line, 2, p_value),
        _far_residuals(x),
    )


def tests_before(fit: CoulombFit) -> ResidualTests:
    """The same of the records under Coulomb friction alone, each test at the record where it is worst."""
    least = LEAST_NOISE * fit.model.scales.signal
    each = []
    for residual in fit.free_residuals:
        rms = math.sqrt(float(residual @ residual) / max(residual.size, 1))
        # a record without noise: the residual is the integrator's error
        x = residual / rms if rms > least else np.zeros(residual.size)
        each.append(ResidualTests(noise_tests(x), rms))
    return worst_of(each)


def worst_of(records: Sequence[ResidualTests]) -> ResidualTests:
    """Each test at the record where it is worst, its p-value that of the least of as many."""
    if len(records) == 1:
        return records[0]
    channels = []
    for same in zip(*(left.channels for left in records), strict=True):
        least = min(same, key=lambda channel: channel.p_value)
        p_value = -math.expm1(len(same) * math.log1p(-min(least.p_value, 1.0 - 1e-12)))
        channels.append(replace(least, p_value=p_value))
    return ResidualTests(tuple(channels), math.sqrt(float(np.mean([left.rms**2 for left in records]))))


def _far_residuals(x: Array) -> Channel:
    """Test of the tails: the number of far residuals, and whether one dwarfs all others."""
    count = int(np.count_nonzero(np.abs(x) > settings.SETTINGS.far))
    p_value = float(stats.binom.sf(count - 1, x.size, 2.0 * stats.norm.sf(settings.SETTINGS.far)))
    largest = float(np.max(np.abs(x), initial=0.0))
    if largest**2 > settings.SETTINGS.minor_share * float(x @ x):
        p_value = min(p_value, 2.0 * x.size * float(stats.norm.sf(largest)))
    return Channel("tails", float(count), x.size, p_value)


def _largest_line(x: Array) -> tuple[float, float]:
    """Largest ordinate of the periodogram over their mean, and its p-value (Fisher)."""
    if x.size < _FEWEST_FOR_A_LINE:
        return 0.0, 1.0
    power = np.abs(np.fft.rfft(x - x.mean())[1:-1]) ** 2
    mean = float(power.mean())
    if mean == 0.0:
        return 0.0, 1.0
    g = float(power.max()) / mean
    return g, float(-np.expm1(power.size * np.log1p(-math.exp(-g)))) if g > 1e-9 else 1.0
