"""The verdict in one word, by the use of the number; the candidates with 95 %; the range where none holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.mechanics.effects import EFFECTS, NoiseEffect
from friction_bayes.mechanics.effects.curved_sensor_drift import CURVED_SENSOR_DRIFT
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.random_force import RANDOM_FORCE
from friction_bayes.mechanics.effects.sensor_drift import SENSOR_DRIFT
from friction_bayes.mechanics.effects.sensor_offset import SENSOR_OFFSET

__all__ = [
    "ADDED",
    "AMBIGUOUS",
    "FORECAST",
    "UNEXPLAINED",
    "credible_candidates",
    "credible_count",
    "verdict",
]

AMBIGUOUS = "ambiguous"
UNEXPLAINED = "unexplained"
FORECAST = "forecast"
"""A forecast may be worse than another by chance: a reason for doubt, not proof that the law is wrong."""
ADDED = {SENSOR_OFFSET.name, SENSOR_DRIFT.name, CURVED_SENSOR_DRIFT.name, PERIODIC_INTERFERENCE.name}
"""What a sensor adds to any motion in the same way, which says nothing of the law."""


def credible_count(probabilities: ArrayLike) -> int:
    """Number of candidates, most probable first, that together have 95 %."""
    return int(np.searchsorted(np.cumsum(probabilities), settings.SETTINGS.credible_mass) + 1)


def credible_candidates(candidates: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """Those of a report's ``candidates``, most probable first, that together have 95 %."""
    return candidates[: credible_count([candidate["probability"] for candidate in candidates])]


def verdict(
    sets: Sequence[frozenset[str]],
    probabilities: Array,
    agrees: Mask,
    against: Sequence[str],
    rubs: float,
    failed: int = 0,
) -> str:
    """Return the verdict.

    Coulomb friction alone, with or without a random force, what a sensor adds to any motion and noise that is
    not the same everywhere, is adequate where the candidates with together 95 % agree on friction, whether
    another effect acts or not; but not where friction itself is so uncertain that all agree. Effects explain
    a record where they have 95 % by themselves, with dry friction or without: a law that does not know
    whether that acts is not known. No effects explain a record that they forecast worse than Coulomb friction
    alone, or the residual of which fails two tests: one may fail by chance.

    Candidates come most probable first, ``agrees`` says which agree with the friction averaged over all,
    ``rubs`` is the probability that dry friction matters, and so many tests of the most probable ``failed``.
    """
    if set(against) - {FORECAST}:
        return UNEXPLAINED
    if against:
        return AMBIGUOUS
    least, effects = settings.SETTINGS.credible_mass, sets[0] - {RANDOM_FORCE.name}
    if effects and failed < 2 and min(float(probabilities[0]), max(rubs, 1.0 - rubs)) >= least:
        return "explained"
    known = min(float(probabilities[agrees].sum()), rubs) >= least
    of_law = {name for name in effects - ADDED if not isinstance(EFFECTS[name], NoiseEffect)}
    return "adequate" if known and not of_law else AMBIGUOUS
