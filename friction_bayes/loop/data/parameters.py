"""The parameters of a loop model, each in a coordinate in which its prior is a standard normal or flat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.mechanics.effects import EFFECTS, Prior, Scales

__all__ = [
    "DISPLACEMENT",
    "FRICTION",
    "LOG_FREQUENCY_RATIO",
    "SHARED",
    "VELOCITY",
    "Coordinate",
    "effect_coordinates",
    "physical_coordinates",
    "scales_of",
]

FRICTION = "friction"
LOG_FREQUENCY_RATIO = "log_frequency_ratio"
"""Logarithm of the fitted over the declared natural frequency."""
DISPLACEMENT, VELOCITY = "displacement", "velocity"
"""State at the start of a record."""
SHARED = -1
"""In place of a record: the parameter is the same for all of them."""


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """One parameter and the coordinate that it is fitted in.

    Attributes
    ----------
    name : str
        ``friction``, ``log_frequency_ratio``, ``displacement``, ``velocity`` or that of the effect.
    prior : Prior
        Weak prior of the value.
    bounds : tuple of float
        Coordinates between which a fit looks for it.
    effect : str
        The effect it belongs to; empty for friction, frequency and state.
    record : int
        The record it belongs to, or ``SHARED``.
    """

    name: str
    prior: Prior
    bounds: tuple[float, float] = (-math.inf, math.inf)
    effect: str = ""
    record: int = SHARED

    def value(self, z: float | Array) -> float | Array:
        """Value of a coordinate."""
        p = self.prior
        if p.family == "log-normal":
            return p.location * np.exp(p.scale * z)
        if p.family == "uniform":
            return p.low + (p.high - p.low) * z
        return p.location + p.scale * z

    def coordinate(self, value: float) -> float:
        """Coordinate of a value."""
        p = self.prior
        if p.family == "log-normal":
            return math.log(value / p.location) / p.scale
        if p.family == "uniform":
            return (value - p.low) / (p.high - p.low)
        return (value - p.location) / p.scale

    def at_score(self, score: float) -> float:
        """Prior quantile of a normal score."""
        if self.prior.family == "uniform":
            return float(self.value(float(special.ndtr(score))))
        # by the nearer tail: a probability next to one is rounded
        side = -1.0 if score > 0.0 else 1.0
        low, high = special.ndtr(sorted(side * end for end in self.support))
        return float(self.value(side * float(special.ndtri(low + (high - low) * special.ndtr(side * score)))))

    @property
    def support(self) -> tuple[float, float]:
        """Prior support of the coordinate."""
        p = self.prior
        if p.family == "log-normal":
            return -math.inf, math.inf
        if p.family == "uniform":
            return 0.0, 1.0
        return (p.low - p.location) / p.scale, (p.high - p.location) / p.scale


def scales_of(segments: Sequence[Segment], system: Oscillator) -> Scales:
    """Scales of the priors: the amplitude is that of the largest motion, half from top to bottom."""
    order = segments[0].order
    # quantiles, so that outliers do not count as motion
    largest = max(
        0.5 * float(np.ptp(np.quantile(segment.decay.values, (0.002, 0.998)))) for segment in segments
    )
    decay = segments[0].decay
    return Scales(
        system=system,
        quantity=decay.quantity,
        amplitude=largest / system.natural_frequency**order,
        duration=max(segment.duration for segment in segments),
        sampling_rate=1.0 / decay.step,
        zero=max(abs(segment.decay.rest_position) for segment in segments),
    )


def physical_coordinates(scales: Scales, records: int) -> tuple[Coordinate, ...]:
    """Friction and frequency, shared; then displacement and velocity at the start of each record."""
    friction = settings.SETTINGS.friction_share * scales.system.stiffness * scales.amplitude
    shared = (
        Coordinate(
            name=FRICTION,
            prior=Prior("normal", 0.0, friction, 0.0),
            bounds=(1e-6, math.inf),
        ),
        Coordinate(
            name=LOG_FREQUENCY_RATIO,
            prior=Prior("normal", 0.0, settings.SETTINGS.frequency_sd),
            bounds=(-1.2 / settings.SETTINGS.frequency_sd, 1.2 / settings.SETTINGS.frequency_sd),
        ),
    )
    wide = settings.SETTINGS.state_share * scales.amplitude
    fast = settings.SETTINGS.state_share * scales.velocity
    state = [
        Coordinate(
            name=name,
            record=r,
            prior=Prior("normal", 0.0, scale),
            bounds=(-20.0, 20.0),
        )
        for r in range(records)
        for name, scale in ((DISPLACEMENT, wide), (VELOCITY, fast))
    ]
    return shared + tuple(state)


def effect_coordinates(name: str, scales: Scales, records: int) -> tuple[Coordinate, ...]:
    """Coordinates of an effect: shared by all records, or one set for each."""
    effect = EFFECTS[name]
    owners = range(records) if effect.per_record else (SHARED,)
    return tuple(
        Coordinate(name=parameter.name, effect=name, record=owner, prior=prior)
        for owner in owners
        for parameter, prior in zip(effect.parameters, effect.priors(scales), strict=True)
    )
