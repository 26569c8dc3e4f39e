"""Parameters of an effect in the report: mean, standard deviation and unit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.system import Oscillator
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.segment import Segment
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.outliers import OUTLIERS

__all__ = ["noise_parameters", "parameter_summary", "parameter_units"]


def parameter_units(name: str, segment: Segment, system: Oscillator) -> dict[str, str]:
    """Unit of each parameter of an effect, by name."""
    return {p.name: p.unit_in(system, segment.decay.unit) for p in EFFECTS[name].parameters}


def parameter_summary(draws: Array, unit: str) -> dict[str, Any]:
    """Mean, standard deviation and unit; not a number where there are too few draws."""
    return {
        "mean": float(draws.mean()) if draws.size else math.nan,
        "sd": float(draws.std(ddof=1)) if draws.size > 1 else math.nan,
        "unit": unit,
    }


def noise_parameters(fit: LoopFit, name: str, units: dict[str, str]) -> dict[str, dict[str, Any]]:
    """Parameters that are no coordinates: those of the outliers, or the level that samples are held at."""
    segment, noise = fit.model.segments[0], fit.noises[0]
    if name == OUTLIERS.name:
        n = max(segment.values.size, 1)
        count = max(noise.fraction * n, 1.0)
        return {
            "fraction": {
                "mean": noise.fraction,
                "sd": math.sqrt(noise.fraction * (1.0 - noise.fraction) / n),
                "unit": units["fraction"],
            },
            "scale": {
                "mean": noise.scale,
                "sd": noise.scale / math.sqrt(2.0 * count),
                "unit": units["scale"],
            },
        }
    held = np.abs(segment.values[segment.sides != 0.0])
    level = float(held.max()) if held.size else math.nan
    return {"level": {"mean": level, "sd": 0.0, "unit": units["level"]}}
