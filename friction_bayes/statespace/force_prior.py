"""The prior of the random force, and points at which its posterior is evaluated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.subset_evidence import SetEvidences

__all__ = ["ForcePrior", "GridPoint", "at_resonance"]


@dataclass(frozen=True, kw_only=True)
class ForcePrior:
    """Prior of the random force: none, or ``log q`` normal and ``log tau`` uniform.

    Attributes
    ----------
    centre : float
        Median of its standard deviation, a force in natural units.
    none : float
        Probability that there is no random force, in (0, 1].
    spread : float
        Standard deviation of ``log q``.
    tau_low, tau_high : float
        Bounds of its correlation time, a phase.

    Raises
    ------
    InputError
        If a number does not make a prior.
    """

    centre: float
    none: float = 0.9
    spread: float = 1.2
    tau_low: float = 0.01 * 2.0 * math.pi
    tau_high: float = 3.0 * 2.0 * math.pi

    def __post_init__(self) -> None:
        sizes = self.centre > 0.0 and self.spread > 0.0 and 0.0 < self.tau_low < self.tau_high
        if not (sizes and 0.0 < self.none <= 1.0):
            raise InputError("random force", f"prior {self}", "give positive sizes and 0 < none <= 1")

    @property
    def without_force(self) -> ForcePrior:
        """The prior without a random force."""
        return replace(self, none=1.0)

    def log_density(self, q: float | Array, tau: float | Array) -> Any:
        """Log density in ``(log q, log tau)`` of the part with a force, its probability included.

        Broadcasts over ``q`` and ``tau``; minus infinity beyond the bounds of ``tau``.
        """
        if self.none >= 1.0:
            return np.full(np.broadcast_shapes(np.shape(q), np.shape(tau)), -math.inf)[()]
        z = (np.log(q) - math.log(self.centre)) / self.spread
        flat = math.log(self.spread) + math.log(math.log(self.tau_high / self.tau_low))
        value = math.log1p(-self.none) - 0.5 * (z * z + math.log(2.0 * math.pi)) - flat
        # few calls of NumPy: every point of a grid comes here
        inside = (self.tau_low <= tau) & (tau <= self.tau_high)
        return np.where(inside, value, -math.inf)[()]


@dataclass(frozen=True, kw_only=True, eq=False)
class GridPoint:
    """A point at which the posterior has been evaluated.

    Attributes
    ----------
    ratio, tau : float
        ``q / sigma``, zero for no force, and the correlation time as a phase.
    log_volume : float
        Log prior probability of its cell.
    found : SetEvidences
        All sets given these.
    """

    ratio: float
    tau: float
    log_volume: float
    found: SetEvidences

    @property
    def row(self) -> int:
        """The best set."""
        return int(np.argmax(self.found.log_weight))

    @property
    def noise(self) -> float:
        """Sensor noise sd in the best set."""
        return float(np.sqrt(self.found.noise2[self.row]))


def at_resonance(tau: float | Array) -> Any:
    """Square root of the spectral density at resonance of a force of unit sd and correlation time ``tau``."""
    return (2.0 * tau / (1.0 + tau * tau)) ** 0.5
