"""Friction as a distribution: draws of it in the unit of the report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.summary import Summary
from friction_bayes.loop.model import LoopModel

__all__ = ["Distribution", "friction_scale", "reported_friction"]


@dataclass(frozen=True, eq=False)
class Distribution:
    """Draws of a number with a unit.

    Attributes
    ----------
    draws : ndarray, shape (m,)
    unit : str
    """

    draws: Array
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """Mean, standard deviation, central 90 % interval and unit."""
        return Summary.of_draws(self.draws, self.unit).to_dict()


def friction_scale(model: LoopModel) -> tuple[float, float, str]:
    """Factor from a model's friction to the reported one, its relative standard deviation, and the unit.

    Of a signal that is not calibrated only friction in the unit of the signal can be reported.
    """
    decay = model.segments[0].decay
    if decay.unit in UNCALIBRATED_UNITS:
        return 1.0 / model.system.force_factor(decay.quantity), 0.0, decay.unit
    return 1.0, model.system.force_factor_relative_sd(decay.quantity), model.system.friction_unit


def reported_friction(values: Array, model: LoopModel, rng: np.random.Generator) -> Distribution:
    """Friction from draws of a model's, with the uncertainty of mass and stiffness where it was given."""
    factor, relative, unit = friction_scale(model)
    if relative > 0.0:
        values = values * (1.0 + relative * rng.standard_normal(values.size))
    return Distribution(factor * values, unit)
