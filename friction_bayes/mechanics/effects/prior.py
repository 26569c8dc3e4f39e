"""Weak priors of effect parameters, scaled by the system and the setting and never by the data."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import Quantity
from friction_bayes.core.system import Oscillator

__all__ = ["Prior", "Scales", "half_normal", "log_normal", "normal", "uniform"]


@dataclass(frozen=True, kw_only=True)
class Scales:
    """What priors may be scaled by.

    Attributes
    ----------
    system : Oscillator
    quantity : Quantity
        What the sensor measures.
    amplitude : float
        Largest displacement the set-up is meant for [m or rad].
    duration : float
        Length of the record [s].
    sampling_rate : float
        Samples per second [Hz].
    zero : float
        How far from the sensor's zero the record rests, as seen when it was cut, unit of the signal.
    """

    system: Oscillator
    quantity: Quantity
    amplitude: float
    duration: float
    sampling_rate: float
    zero: float = 0.0

    @property
    def velocity(self) -> float:
        """Velocity amplitude [m/s or rad/s]."""
        return self.amplitude * self.system.natural_frequency

    @property
    def signal(self) -> float:
        """Amplitude in the unit of the signal."""
        return float(self.amplitude * self.system.natural_frequency**self.quantity.order)

    @property
    def offset(self) -> float:
        """Size of an error of the sensor's zero: a tenth of the amplitude, or all that is seen of it."""
        return max(0.1 * self.signal, self.zero)


@dataclass(frozen=True)
class Prior:
    """A normal (cut to its support), log-normal or uniform density.

    Attributes
    ----------
    family : {"normal", "log-normal", "uniform"}
    location : float
        Mean before the cut; median of a log-normal; unused by a uniform.
    scale : float
        Standard deviation before the cut; that of the logarithm for a log-normal; unused by a uniform.
    low, high : float
        Support.
    """

    family: Literal["normal", "log-normal", "uniform"]
    location: float
    scale: float
    low: float = -math.inf
    high: float = math.inf

    def log_density(self, value: ArrayLike) -> Array:
        """Log-density, normalised over the support; minus infinity outside it."""
        x = np.asarray(value, dtype=float)
        inside = (x >= self.low) & (x <= self.high)
        if self.family == "uniform":
            return np.where(inside, -math.log(self.high - self.low), -np.inf)
        if self.family == "log-normal":
            inside &= x > 0.0
            logarithm = np.log(np.where(inside, x, 1.0))
            z = (logarithm - math.log(self.location)) / self.scale
            jacobian, mass = logarithm, 1.0
        else:
            z = np.where(inside, (x - self.location) / self.scale, 0.0)
            jacobian, mass = np.zeros_like(x), self._mass()
        density = -0.5 * z * z - math.log(self.scale * mass) - 0.5 * math.log(2.0 * math.pi) - jacobian
        return np.where(inside, density, -np.inf)

    def _mass(self) -> float:
        low, high = (self.low - self.location) / self.scale, (self.high - self.location) / self.scale
        return float(special.ndtr(high) - special.ndtr(low))

    @property
    def distribution(self) -> Any:
        """The same density as a frozen scipy.stats distribution, made once: SciPy takes a millisecond."""
        return _frozen(self)


@lru_cache(maxsize=256)
def _frozen(prior: Prior) -> Any:
    if prior.family == "uniform":
        return stats.uniform(prior.low, prior.high - prior.low)
    if prior.family == "log-normal":
        return stats.lognorm(prior.scale, scale=prior.location)
    low, high = (prior.low - prior.location) / prior.scale, (prior.high - prior.location) / prior.scale
    return stats.truncnorm(low, high, loc=prior.location, scale=prior.scale)


def normal(scale: float, low: float = -math.inf, high: float = math.inf) -> Prior:
    """Normal about zero, cut to ``[low, high]``."""
    return Prior("normal", 0.0, scale, low, high)


def half_normal(scale: float, high: float = math.inf) -> Prior:
    """Normal about zero, cut to what is not negative."""
    return Prior("normal", 0.0, scale, 0.0, high)


def log_normal(median: float, scale: float) -> Prior:
    """Log-normal with the given median and standard deviation of the logarithm."""
    return Prior("log-normal", median, scale, 0.0)


def uniform(low: float, high: float) -> Prior:
    """Uniform over ``[low, high]``."""
    return Prior("uniform", 0.5 * (low + high), high - low, low, high)
