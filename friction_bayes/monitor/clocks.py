"""Laws of wear as clocks: a Wiener process with drift that runs on a clock of its own.

Wear that accelerates, slows down, saturates or kinks is the same process as steady wear on another clock
(Whitmore & Schenkelberg 1997): friction is ``level + drift u + sqrt(v) W(u)`` at the reading ``u`` of a clock
that shows zero at T1 and the time observed at Tn. Every clock thus has the same two coefficients with the
same meaning, so that the evidence of laws can be compared, and the first passage on the clock has the closed
form of :mod:`friction_bayes.monitor.remaining_life`. A clock that stops before the threshold is reached says
that it never is.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import betainc

from friction_bayes.core.arrays import Array
from friction_bayes.monitor.remaining_life import RemainingLife

__all__ = ["LAWS", "ExponentialClock", "JumpClock", "KinkClock", "PowerClock", "WearClock"]

LAWS = ("linear", "accelerating", "decelerating", "saturating", "kinked", "jumps")
"""Names of the laws of wear, equally probable beforehand."""

_LARGEST_EXPONENT = 600.0
"""Of e, in the reading of a clock: beyond any threshold, and far from overflow."""
_MOST_JUMPS = 1e7
"""Jumps up to the threshold that differ from never reaching it."""
_RATE_SHAPE = 0.5
"""Shape of the gamma prior of the rate of jumps: that of Jeffreys."""
_ONLY_ONE = 0.5
"""Probability that a single jump is the only one there ever is."""


class WearClock(Protocol):
    """A law of wear. Times and readings are in units of the time observed, from T1 on."""

    def reading(self, time: Array) -> Array:
        """Return what the clock shows: 0 at T1, 1 at Tn."""

    @property
    def pace(self) -> float:
        """Pace of the clock at Tn: by it a drift on the clock is a drift per unit of time."""

    def when(self, reading: Array) -> Array:
        """Return the times at which to look for a first passage found at these readings, each at least 1."""

    def reached(self, life: RemainingLife, time: Array) -> Array:
        """Return the probability to have reached the threshold by a time, each at least 1.

        ``life`` counts from Tn on the clock.
        """


class _SmoothClock(ABC):
    """A clock that never jumps: a first passage on it is one in time."""

    @abstractmethod
    def reading(self, time: Array) -> Array:
        """Return what the clock shows."""

    def reached(self, life: RemainingLife, time: Array) -> Array:
        """Return the probability that the clock has come to the first passage by a time."""
        return life.cdf(self.reading(time) - 1.0)


@dataclass(frozen=True)
class PowerClock(_SmoothClock):
    """Wear that goes as a power of the time since it began, ``(time + begun)**power``.

    Attributes
    ----------
    power : float
        Positive; 1 is steady wear.
    begun : float
        How long before T1 wear began, in units of the time observed.
    """

    power: float = 1.0
    begun: float = 0.0

    @property
    def _whole(self) -> float:
        return (1.0 + self.begun) ** self.power - self.begun**self.power

    def reading(self, time: Array) -> Array:
        """Return what the clock shows."""
        return ((time + self.begun) ** self.power - self.begun**self.power) / self._whole

    @property
    def pace(self) -> float:
        """Pace at Tn."""
        return self.power * (1.0 + self.begun) ** (self.power - 1.0) / self._whole

    def when(self, reading: Array) -> Array:
        """Return the times of these readings."""
        return (reading * self._whole + self.begun**self.power) ** (1.0 / self.power) - self.begun


@dataclass(frozen=True)
class ExponentialClock(_SmoothClock):
    """Wear whose rate grows (``growth > 0``) or dies away exponentially, ``exp(growth time)``.

    Attributes
    ----------
    growth : float
        Per unit of the time observed, not zero. Below zero the clock stops: friction saturates.
    """

    growth: float

    def reading(self, time: Array) -> Array:
        """Return what the clock shows."""
        exponent = np.minimum(self.growth * time, _LARGEST_EXPONENT)
        return np.expm1(exponent) / math.expm1(self.growth)

    @property
    def pace(self) -> float:
        """Pace at Tn."""
        return self.growth * math.exp(self.growth) / math.expm1(self.growth)

    def when(self, reading: Array) -> Array:
        """Return the times of these readings, of those that the clock ever shows."""
        grown = reading * math.expm1(self.growth)
        return np.log1p(grown[grown > -1.0]) / self.growth


@dataclass(frozen=True)
class KinkClock(_SmoothClock):
    """Steady wear whose rate changes once, at a kink, and stays what it then is.

    Attributes
    ----------
    kink : float
        When, in units of the time observed, from 0 to 1.
    ratio : float
        Rate after the kink over the rate before it, positive.
    """

    kink: float
    ratio: float

    @property
    def _whole(self) -> float:
        return self.kink + self.ratio * (1.0 - self.kink)

    def reading(self, time: Array) -> Array:
        """Return what the clock shows."""
        return (time + (self.ratio - 1.0) * np.maximum(time - self.kink, 0.0)) / self._whole

    @property
    def pace(self) -> float:
        """Pace at Tn, after the kink."""
        return self.ratio / self._whole

    def when(self, reading: Array) -> Array:
        """Return the times of these readings, each at least 1."""
        return 1.0 + (reading - 1.0) / self.pace


@dataclass(frozen=True)
class JumpClock:
    """Wear in jumps: the clock ticks at a jump and stops otherwise.

    A jump is an increment of the Wiener process; a single one may have been the only one there ever is.
    More come as a Poisson process, whose rate has the gamma posterior of the jumps seen in the time observed,
    so that their number is negative binomial.

    Attributes
    ----------
    after : tuple of float
        Times of the detection points after which there was a jump, in units of the time observed.
    """

    after: tuple[float, ...]

    def reading(self, time: Array) -> Array:
        """Return the share of the jumps that has come."""
        return np.searchsorted(np.array(self.after), time, side="left") / len(self.after)

    @property
    def pace(self) -> float:
        """Mean pace over the time observed."""
        return 1.0

    def when(self, reading: Array) -> Array:
        """Return times over which so many jumps may come."""
        return reading

    def reached(self, life: RemainingLife, time: Array) -> Array:
        """Return the probability that enough jumps have come by a time."""
        seen = len(self.after)
        jumps = np.unique(np.rint(np.logspace(0.0, math.log10(_MOST_JUMPS), 120)))
        needed = np.diff(life.cdf(jumps / seen), prepend=life.already)
        later, some = (time - 1.0)[:, None], needed != 0.0
        come = betainc(jumps[some], seen + _RATE_SHAPE, later / (1.0 + later)) @ needed[some]
        return np.asarray(life.already + (1.0 - _ONLY_ONE * (seen == 1)) * come)
