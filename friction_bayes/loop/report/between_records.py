"""Friction that differs between records: each one's, their spread, and whether they contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary
from friction_bayes.loop.infer.law_draws import DRAWS, DrawnLaws, draw_laws
from friction_bayes.loop.infer.law_fit import LawFit
from friction_bayes.loop.infer.record_fit import ForceFit

__all__ = ["friction_between_records"]


def friction_between_records(
    laws: DrawnLaws,
    alone: Sequence[ForceFit],
    *,
    shift: Array,
    probability: float,
    scale: Array,
    unit: str,
    rng: np.random.Generator,
) -> dict[str, Any]:
    """The report's ``friction_between_records``.

    Parameters
    ----------
    laws : DrawnLaws
    alone : sequence of ForceFit, length r
        Each record by itself.
    shift : ndarray, shape (k,)
        What slight effects that all records share add to the friction of each [N or N m].
    probability : float
        That friction differs.
    scale : ndarray, shape (k,)
        Draws of the factor from the model's friction to the reported one.
    unit : str
        Of the latter.
    rng : numpy.random.Generator
    """
    differs = laws.spread > 0.0
    spread = laws.spread[differs]
    return {
        "probability": probability,
        "spread": Summary.of_draws(scale[differs] * spread, unit).to_dict() if spread.size > 1 else None,
        "share_of_friction": float(np.median(spread / laws.friction[differs])) if spread.size else 0.0,
        "reduced_chi_square": _reduced_chi_square(alone, rng),
        "records": [
            {
                "name": one.fit.segment.decay.name,
                "friction": Summary.of_draws(np.abs(scale * (one.friction + shift)), unit).to_dict(),
            }
            for one in laws.records
        ],
    }


def _reduced_chi_square(alone: Sequence[ForceFit], rng: np.random.Generator) -> float:
    """Reduced chi-square of the frictions by each record alone, about their weighted mean."""
    drawn = [draw_laws(LawFit.of(one), rng, DRAWS).friction for one in alone]
    mean, weight = np.array([x.mean() for x in drawn]), np.array([1.0 / x.var() for x in drawn])
    centre = float(weight @ mean / weight.sum())
    return float(weight @ (mean - centre) ** 2 / (len(drawn) - 1))
