"""The effects of the most probable candidate in the report: probability and parameters with units."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.candidate import SearchResult, in_catalogue_order
from friction_bayes.loop.fit import LoopFit
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.mechanics.effects.outliers import OUTLIERS

__all__ = ["effect_summaries"]


def effect_summaries(found: SearchResult, draws: Array) -> list[dict[str, Any]]:
    """Name, inclusion probability and parameters of each effect of the most probable candidate.

    Parameters
    ----------
    found : SearchResult
    draws : ndarray, shape (k, p)
        Coordinates of the most probable candidate.
    """
    best = found.fits[0]
    summaries = []
    for name in in_catalogue_order(found.sets[0]):
        held = [name in s for s in found.sets]
        unit = best.model.segments[0].decay.unit
        units = {p.name: p.unit_in(best.model.system, unit) for p in EFFECTS[name].parameters}
        parameters: dict[str, Any] = {}
        for j, c in enumerate(best.model.coordinates):
            if c.effect == name:
                values = np.asarray(c.value(draws[:, j]))
                key = best.model.numbered(c.name, c)
                parameters[key] = {"mean": _mean(values), "sd": _sd(values), "unit": units[c.name]}
        summaries.append(
            {
                "name": name,
                "probability": float(found.probabilities[held].sum()),
                "parameters": parameters or _noise_parameters(best, name, units),
            }
        )
    return summaries


def _mean(values: Array) -> float:
    return float(values.mean()) if values.size else math.nan


def _sd(values: Array) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else math.nan


def _noise_parameters(fit: LoopFit, name: str, units: dict[str, str]) -> dict[str, Any]:
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
