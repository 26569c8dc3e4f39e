"""Sets of effects as hypotheses: which may be formed, and how probable each is before the data."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.inclusion import INCLUSION
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = ["SENSOR_ZERO", "EffectSets", "in_catalogue_order", "searched", "set_name"]

SENSOR_ZERO = frozenset({SENSOR_OFFSET.name, SENSOR_DRIFT.name})
"""An error of the sensor's zero comes besides: measured records hardly ever have none."""
Names = frozenset[str]


@dataclass(frozen=True)
class EffectSets:
    """The sets that may be formed.

    Parameters
    ----------
    allowed : tuple of str
        Effects that may be tried.
    certain : frozenset of str
        Effects that the samples prove before any model.
    """

    allowed: tuple[str, ...]
    certain: Names

    def counted(self, names: Names) -> int:
        """Effects of a set that count towards the most at once."""
        return len(names - self.certain - SENSOR_ZERO)

    def is_single(self, names: Names) -> bool:
        """Whether a set holds at most one effect that is not certain."""
        return len(names - self.certain) <= 1

    def log_prior(self, names: Names) -> float:
        """Logarithm of the prior probability of a set."""
        others = len(self.allowed) - len(names)
        return len(names - self.certain) * math.log(INCLUSION) + others * math.log1p(-INCLUSION)


def searched(names: Iterable[str], *, named: bool) -> tuple[str, ...]:
    """Effects that the search tries of some, which have been ``named`` or are all that there are."""
    wanted = ("always", "if named") if named else ("always",)
    return tuple(name for name in names if EFFECTS[name].search in wanted)


def in_catalogue_order(names: Names) -> tuple[str, ...]:
    """Effects of a set in the order of the catalogue."""
    return tuple(name for name in EFFECTS if name in names)


def set_name(names: Names) -> str:
    """Name a set as the steps of the search do."""
    return "+".join(in_catalogue_order(names)) or "Coulomb friction alone"
