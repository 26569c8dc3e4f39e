"""Coordinates of effects in a fit by simulation: their bounds and support, and where it starts."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.data.model import LoopModel
from friction_bayes.loop.data.parameters import Coordinate
from friction_bayes.mechanics.effects import EFFECTS, ForceEffect, Parameter

__all__ = ["bounds_of", "is_angle", "prior_precision", "start_of", "support_of"]


@lru_cache(maxsize=8)
def bounds_of(model: LoopModel) -> tuple[Array, Array]:
    """Bounds of a model's coordinates within which the force laws are defined, each of shape (p,).

    Wider than the prior's support where the law can be continued through its null.
    """
    ends = np.array([_bounds(c) for c in model.coordinates])
    return ends[:, 0], ends[:, 1]


@lru_cache(maxsize=8)
def support_of(model: LoopModel) -> tuple[Array, Array]:
    """Support of the prior of each coordinate, each of shape (p,); an angle has no end."""
    ends = np.array([(-math.inf, math.inf) if is_angle(c) else c.support for c in model.coordinates])
    return ends[:, 0], ends[:, 1]


@lru_cache(maxsize=8)
def prior_precision(model: LoopModel) -> Array:
    """Prior precision of each coordinate, shape (p,): zero where its prior is uniform."""
    return np.array([0.0 if c.prior.family == "uniform" else 1.0 for c in model.coordinates])


def start_of(c: Coordinate) -> float:
    """Where a fit starts by default: the null, or the prior's median where there is no null."""
    if _only_shapes(c):
        return c.coordinate(c.at_score(0.0))
    return c.coordinate(0.0) if c.prior.family == "uniform" and not is_angle(c) else 0.0


def is_angle(c: Coordinate) -> bool:
    """Whether a coordinate is an angle."""
    return c.prior.family == "uniform" and _parameter(c).unit == "rad"


def _parameter(c: Coordinate) -> Parameter:
    return next(each for each in EFFECTS[c.effect].parameters if each.name == c.name)


def _only_shapes(c: Coordinate) -> bool:
    """A parameter that cannot vanish has no null; nor has one whose flat prior excludes zero."""
    if not c.effect:
        return False
    prior, parameter = c.prior, _parameter(c)
    if prior.family == "uniform":
        may_vanish = prior.low <= 0.0 < prior.high and not parameter.open_low
        return not is_angle(c) and not may_vanish
    return prior.family == "log-normal" or parameter.open_low


def _bounds(c: Coordinate) -> tuple[float, float]:
    """A force that is linear in a parameter may be continued through its null; no other term may."""
    if not c.effect:
        return c.bounds
    prior, parameter = c.prior, _parameter(c)
    if prior.family == "log-normal":
        # values beyond six prior standard deviations are not fitted
        return -6.0, 6.0
    low, high = parameter.low, parameter.high
    if prior.family == "uniform":
        width = prior.high - prior.low if is_angle(c) else 0.0
        low, high = prior.low - width, prior.high + width
    elif isinstance(EFFECTS[c.effect], ForceEffect) and low == 0.0 and not parameter.open_low:
        low = -0.5 * prior.scale
    return c.coordinate(low), c.coordinate(high)
