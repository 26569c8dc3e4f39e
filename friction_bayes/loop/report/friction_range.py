"""Friction where no candidate explains the record: by the candidates, and by Coulomb friction alone.

A posterior over candidates none of which is true gives how well the record separates them, not how far each
is from the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import Summary

__all__ = ["Reading", "friction_range"]


@dataclass(frozen=True, eq=False)
class Reading:
    """Friction by one reading of the record.

    Attributes
    ----------
    what : str
        The way, in words.
    friction : ndarray, shape (k,)
        Draws [N or N m].
    """

    what: str
    friction: Array


def friction_range(readings: Sequence[Reading], factor: float, unit: str) -> dict[str, Any]:
    """Return the report's ``friction_range``: lowest and highest mean of a reading, and each reading.

    Parameters
    ----------
    readings : sequence of Reading
    factor : float
        From a model's friction to the reported one.
    unit : str
        Of the latter.
    """
    each = [
        {"what": reading.what} | Summary.of_draws(factor * reading.friction, unit).to_dict()
        for reading in readings
    ]
    means = [reading["mean"] for reading in each]
    return {"low": min(means), "high": max(means), "unit": unit, "readings": each}
