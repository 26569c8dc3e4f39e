"""Forces on the mass other than the spring's: friction that fluctuates, random forces, a hand, a drive."""

from __future__ import annotations

import math
from bisect import bisect

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from experiments.ordinary.forced_motion import Friction

__all__ = [
    "hand",
    "ornstein_uhlenbeck_force",
    "pink_friction",
    "redrawn_friction",
    "rough_friction",
    "steady_friction",
    "telegraph_friction",
]

_LEAST = 0.05
"""Share of the mean below which no friction falls."""


def steady_friction(level: float) -> Friction:
    """The same friction [N] always."""
    return lambda time, place, half_cycle: level


def redrawn_friction(rng: np.random.Generator, level: float, share: float, half_cycles: int) -> Friction:
    """Friction drawn anew at each turning point, from a normal law.

    Parameters
    ----------
    rng : Generator
    level : float
        Mean [N].
    share : float
        Standard deviation over the mean.
    half_cycles : int
        How many are drawn; after these it goes on with the last.
    """
    drawn = level * np.maximum(1.0 + share * rng.standard_normal(half_cycles), _LEAST)
    levels = drawn.tolist()
    return lambda time, place, half_cycle: levels[min(half_cycle, half_cycles - 1)]


def telegraph_friction(
    rng: np.random.Generator, level: float, share: float, dwell: float, duration: float
) -> Friction:
    """Friction that jumps between two levels at random times.

    Parameters
    ----------
    rng : Generator
    level : float
        Between the two levels [N].
    share : float
        Of the distance to either over ``level``.
    dwell : float
        Mean time between jumps [s].
    duration : float
        Of the motion [s].
    """
    waits = rng.exponential(dwell, size=math.ceil(3.0 * duration / dwell) + 20)
    jumps = np.cumsum(waits).tolist()
    first = float(rng.choice([-1.0, 1.0]))

    def friction(time: float, place: float, half_cycle: int) -> float:
        side = first if bisect(jumps, time) % 2 == 0 else -first
        return level * (1.0 + share * side)

    return friction


def pink_friction(rng: np.random.Generator, level: float, share: float, step: float, n: int) -> Friction:
    """Friction with a spectral density of 1/f from the length of the motion down to twice the step.

    Parameters
    ----------
    rng : Generator
    level : float
        Mean [N].
    share : float
        Standard deviation over the mean.
    step : float
        Between points, between which friction is linear [s].
    n : int
        Points.
    """
    frequencies = np.fft.rfftfreq(n)
    weights = np.zeros(frequencies.size)
    weights[1:] = frequencies[1:] ** -0.5
    normal = rng.standard_normal((2, frequencies.size))
    path = np.fft.irfft(weights * (normal[0] + 1j * normal[1]), n)
    levels = (level * np.maximum(1.0 + share * path / path.std(), _LEAST)).tolist()

    def friction(time: float, place: float, half_cycle: int) -> float:
        i = min(int(time / step), n - 2)
        return levels[i] + (levels[i + 1] - levels[i]) * (time / step - i)

    return friction


def rough_friction(rng: np.random.Generator, level: float, share: float, wavelength: float) -> Friction:
    """Friction that depends on the place: two waves along the track, neither a multiple of the other.

    Parameters
    ----------
    rng : Generator
    level : float
        Mean along the track [N].
    share : float
        Standard deviation along the track over the mean.
    wavelength : float
        Of the longer wave [m].
    """
    first, second = rng.uniform(0.0, 2.0 * math.pi, size=2).tolist()
    k1 = 2.0 * math.pi / wavelength
    k2 = math.sqrt(5.0) * k1

    def friction(time: float, place: float, half_cycle: int) -> float:
        wave = math.sin(k1 * place + first) + math.sin(k2 * place + second)
        return level * max(1.0 + share * wave, _LEAST)

    return friction


def ornstein_uhlenbeck_force(
    rng: np.random.Generator, sd: float, correlation_time: float, step: float, n: int
) -> NDArray[np.float64]:
    """Stationary path with covariance ``sd**2 exp(-abs(t - u) / correlation_time)``, exact on its grid.

    Parameters
    ----------
    rng : Generator
    sd : float
        Standard deviation [N].
    correlation_time, step : float
        [s].
    n : int
        Points.
    """
    kept = math.exp(-step / correlation_time)
    kicks = rng.standard_normal(n) * math.sqrt(1.0 - kept**2)
    kicks[0] /= math.sqrt(1.0 - kept**2)
    return sd * np.asarray(lfilter([1.0], [1.0, -kept], kicks))


def hand(size: float, until: float, step: float, n: int) -> NDArray[np.float64]:
    """Force of a hand that lets go smoothly: ``size`` at the release, zero from ``until`` [s] on."""
    times = step * np.arange(n)
    return np.where(times < until, size * np.cos(0.5 * math.pi * times / until) ** 2, 0.0)
