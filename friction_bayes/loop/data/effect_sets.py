"""Sets of effects: those that are combined with every set, and the order in which they are reported."""

from __future__ import annotations

from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["SENSOR_ZERO", "in_catalogue_order"]

SENSOR_ZERO = frozenset({SENSOR_OFFSET.name, SENSOR_DRIFT.name})
"""An error of the sensor's zero is combined with every set: nearly every measured record has one."""


def in_catalogue_order(names: frozenset[str]) -> tuple[str, ...]:
    """Effects of a set in the order of the catalogue."""
    return tuple(name for name in EFFECTS if name in names)
