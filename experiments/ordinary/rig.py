"""A mass on a spring with dry friction, and what all recordings of one have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["SENSORS", "Motion", "OrdinaryRecord", "Recipe", "Rig"]

SENSORS = ("displacement", "velocity", "acceleration")
"""Quantities that are recorded; each the derivative of the one before."""


@dataclass(frozen=True)
class Rig:
    """Mass [kg], stiffness [N/m] and dry friction [N]."""

    mass: float
    stiffness: float
    friction: float

    @property
    def frequency(self) -> float:
        """Natural frequency [rad/s]."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def period(self) -> float:
        """Of the motion [s]."""
        return 2.0 * math.pi / self.frequency

    @property
    def half_drop(self) -> float:
        """Friction over stiffness: half of what the amplitude loses in a half cycle [m]."""
        return self.friction / self.stiffness


class Motion(Protocol):
    """What a simulated motion provides."""

    def sample(self, times: NDArray[np.float64], quantity: str) -> NDArray[np.float64]:
        """Displacement, velocity or acceleration at ``times`` [s] after the release."""

    def mean_friction(self, start: float, stop: float) -> float:
        """Mean friction [N] over the path travelled from ``start`` to ``stop`` [s]."""


@dataclass(frozen=True, kw_only=True)
class OrdinaryRecord:
    """A recording, what its owner declares of the system, and the truth.

    Attributes
    ----------
    times : ndarray, shape (n,)
        From 0 [s].
    values : ndarray, shape (n,)
        SI units.
    quantity : {"displacement", "velocity", "acceleration"}
    mass, stiffness : float
        [kg], [N/m].
    truth : callable (start, stop) -> float, or None
        Mean friction [N] along the path between two times of the recording; None where nothing decays
        freely.
    gain : float
        By what the way from sensor to file multiplies a signal at the motion's frequency.
    facts : mapping
        What was drawn, for tables: numbers by name.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    quantity: str
    mass: float
    stiffness: float
    truth: Callable[[float, float], float] | None
    gain: float = 1.0
    facts: Mapping[str, float] = field(default_factory=dict)


Recipe = Callable[[np.random.Generator, int], OrdinaryRecord]
"""A record from a generator and its number within the row; what goes round goes by the number."""
