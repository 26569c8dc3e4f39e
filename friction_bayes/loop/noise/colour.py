"""Coloured noise of the sensor in place of white noise and of a random force, where the spectrum shows it.

Filters of the acquisition, differences of positions and interpolation colour the noise. Above the eighth
harmonic of the motion a free decay has almost no power, whatever the force law: where the spectrum of a
residual is flat there, the noise is white and everything else in it is misfit. Where it is not, an
autoregression of it (:mod:`friction_bayes.statespace.coloured_noise`) is an alternative to white noise with
or without a random force, penalised for its coefficients.

Where it is more probable, the law is found under noise of the sensor's level near the motion's frequency,
and of that colour where it is stronger (:mod:`friction_bayes.estimators.noise.noise_level`): a filter removes
the corners of the motion with the noise, so that a quiet band above is no evidence about friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from friction_bayes.core.arrays import Array
from friction_bayes.estimators.noise.noise_level import noise_floor, sensor_noise
from friction_bayes.loop import settings
from friction_bayes.statespace.coloured_noise import Autoregression, burg
from friction_bayes.statespace.kalman import Clock

__all__ = ["Colour", "colour_near_motion", "colour_of", "is_coloured"]

_GRID = 1025
"""Frequencies of a spectrum whose transform is the correlation of the noise."""
_HANN_SPREAD = 1.5
"""Neighbouring ordinates of a Hann-windowed periodogram are correlated: so many count as one."""


@dataclass(frozen=True, eq=False)
class Colour:
    """Noise of the sensor that is coloured.

    Attributes
    ----------
    autoregression : Autoregression or None
        None where the noise is taken as white, being weaker far above the motion's frequency.
    least_noise : float
        Least sd of the noise, natural units.
    """

    autoregression: Autoregression | None
    least_noise: float = 0.0
    share = 1.0
    """Sd of the whole noise over that of the part that a posterior knows: all of it."""

    @property
    def log_volume(self) -> float:
        """Penalty of its coefficients in log evidence, negative."""
        return 0.0 if self.autoregression is None else -self.autoregression.penalty

    def of(self, clock: Clock, w0: float) -> Clock:
        """A clock with this noise, which goes from sample to sample whatever the frequency ``w0`` [rad/s]."""
        return replace(clock, autoregression=self.autoregression)

    def alike(self, other: object) -> bool:
        """Whether another is as good: it follows the residual of the law, and converges with that."""
        return isinstance(other, Colour)

    def described(self, step: float) -> dict[str, float | int | str]:
        """Fields of the report, of samples every ``step`` [s]."""
        if self.autoregression is None:
            return {"model": "ar", "order": 0, "correlation_length_s": step}
        # the correlation extends beyond as many samples as there are coefficients
        correlation = np.fft.irfft(self.autoregression.spectrum(np.linspace(0.0, math.pi, _GRID)))[:_GRID]
        below = np.flatnonzero(correlation < correlation[0] / math.e)
        length = int(below[0]) if below.size else correlation.size
        order = self.autoregression.order
        return {"model": "ar", "order": order, "correlation_length_s": float(step * length)}


def colour_of(residual: Array, fitted: int) -> Colour | None:
    """Colour of the residual of a law with so many coefficients, shape (n,); None where that is white."""
    own, _ = burg(residual, fitted)
    # behind a filter that removes everything an autoregression is singular to rounding
    return Colour(own.levelled(0.0, 0.0)) if own.order else None


def colour_near_motion(residual: Array, phase: Array, order: int, fitted: int) -> Colour:
    """The same of noise that is nowhere below its level near the motion's frequency.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Residual of the law at even samples, natural units.
    phase : ndarray, shape (n,)
        Of the samples.
    order : int
        Order of the derivative measured.
    fitted : int
        Coefficients of the law.
    """
    noise = sensor_noise(residual, phase, fitted, noise_floor(residual, phase, order, fitted), even=True)
    return Colour(noise.colour, noise.coloured_floor)


def is_coloured(residual: Array, step: float, frequency: float) -> bool:
    """Whether the spectrum above the motion's harmonics is not flat.

    Parameters
    ----------
    residual : ndarray, shape (n,)
    step : float
        Sampling interval [s].
    frequency : float
        Of the motion [rad/s].
    """
    n = residual.size
    limit = float(settings.SETTINGS.far * 1.4826 * np.median(np.abs(residual - np.median(residual))))
    tame = np.clip(residual - residual.mean(), -limit, limit)
    power = np.abs(np.fft.rfft(tame * np.hanning(n)))[1:-1] ** 2
    lowest = frequency * step * n / (2.0 * math.pi)
    first = int(settings.SETTINGS.quiet_harmonic * lowest)
    if power.size - first < 20 * settings.SETTINGS.bins:
        # sampled too coarsely to look above all of its harmonics: above half of them instead
        first = int(0.5 * settings.SETTINGS.quiet_harmonic * lowest)
    bands = np.array_split(power[first:], settings.SETTINGS.bins)
    size = min(band.size for band in bands)
    if size < 10:
        return False
    # medians, so that a line of interference does not count as colour
    level = np.log([np.median(band) for band in bands])
    variance = _HANN_SPREAD / (size * math.log(2.0) ** 2)
    statistic = float(np.sum((level - level.mean()) ** 2)) / variance
    p_value = float(stats.chi2.sf(statistic, settings.SETTINGS.bins - 1))
    return p_value < settings.SETTINGS.noise_alarm_rate
