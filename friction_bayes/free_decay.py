"""The moving part of a record: where the free decay starts and stops, its rest position and rough phase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from friction_bayes.mechanics.oscillator import Oscillator
from friction_bayes.quantities import Quantity

__all__ = ["FreeDecay"]


@dataclass(frozen=True, kw_only=True)
class FreeDecay:
    """What every estimator is given: the moving samples, cut once from the data, before any model.

    Attributes
    ----------
    name : str
        Name of the record.
    values : ndarray, shape (n,)
        Samples of the moving part, as recorded (rest position not subtracted).
    start_time : float
        Time of ``values[0]`` in the record [s].
    step : float
        Sampling interval [s].
    quantity : Quantity
        What was measured.
    unit : str
        Its unit; not SI when the sensor was not calibrated.
    frequency : float
        Rough angular frequency found in the data [rad/s].
    phase : float
        Rough phase of ``values[0]`` in [0, 2 pi): zero is a turning point on the positive side
        of the *displacement*, whatever was measured.
    rest_position : float
        Rough rest position in the unit of the signal, or the one given.
    stops : bool
        Whether the motion came to rest within the record.
    """

    name: str
    values: NDArray[np.float64]
    start_time: float
    step: float
    quantity: Quantity
    unit: str
    system: Oscillator
    frequency: float
    phase: float
    rest_position: float
    stops: bool

    @property
    def time(self) -> NDArray[np.float64]:
        """Seconds since the first moving sample, shape (n,)."""
        return np.arange(self.values.size) * self.step
