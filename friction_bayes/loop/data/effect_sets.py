"""Sets of effects: which of them come besides, and in which order they are told."""

from __future__ import annotations

from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["SENSOR_ZERO", "in_catalogue_order"]

SENSOR_ZERO = frozenset({SENSOR_OFFSET.name, SENSOR_DRIFT.name})
"""An error of the sensor's zero comes besides: measured records hardly ever have none."""


def in_catalogue_order(names: frozenset[str]) -> tuple[str, ...]:
    """Effects of a set in the order of the catalogue."""
    return tuple(name for name in EFFECTS if name in names)
