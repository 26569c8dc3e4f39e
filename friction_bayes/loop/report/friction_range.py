"""Friction where no candidate explains the record: by the candidates, and by Coulomb friction alone.

A posterior over candidates none of which is true gives how well the record separates them, not how far each
is from the truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary

__all__ = ["friction_range"]


def friction_range(readings: Mapping[str, Array], factor: float, unit: str) -> dict[str, Any]:
    """Return the report's ``friction_range``: lowest and highest mean of a reading, and each reading.

    Parameters
    ----------
    readings : mapping of str to ndarray, shape (k,)
        Draws of friction [N or N m] by each reading of the record, in words.
    factor : float
        From a model's friction to the reported one.
    unit : str
        Of the latter.
    """
    each = [
        {"what": what} | Summary.of_draws(factor * friction, unit).to_dict()
        for what, friction in readings.items()
    ]
    means = [reading["mean"] for reading in each]
    return {"low": min(means), "high": max(means), "unit": unit, "readings": each}
