"""The free decay under constant dry friction, exact: every half cycle is a cosine about its own centre."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from experiments.ordinary.rig import Rig

__all__ = ["CoulombMotion"]


class CoulombMotion:
    """``m x'' + r sign(x') + k x = 0`` after a release at rest, held there before.

    Between two turning points ``x = c + a cos(w (t - t0))`` with ``c = r/k`` against the direction of motion;
    the mass stays at the first turning point with ``abs(x) <= r/k``.

    Parameters
    ----------
    rig : Rig
    amplitude : float
        Displacement at the release, at time 0 [m].

    Attributes
    ----------
    turning_points : ndarray, shape (n,)
        Displacement at the release and at every turning point; the last is where the mass stays [m].
    """

    def __init__(self, rig: Rig, amplitude: float) -> None:
        self._rig = rig
        points = [amplitude]
        while abs(points[-1]) > rig.half_drop:
            points.append(-points[-1] + math.copysign(2.0 * rig.half_drop, points[-1]))
        self.turning_points: NDArray[np.float64] = np.array(points)

    def sample(self, times: NDArray[np.float64], quantity: str) -> NDArray[np.float64]:
        """Displacement [m], velocity [m/s] or acceleration [m/s2] at ``times`` [s].

        Parameters
        ----------
        times : ndarray, shape (n,)
            Negative before the release.
        quantity : {"displacement", "velocity", "acceleration"}
        """
        w = self._rig.frequency
        last = self.turning_points.size - 1
        half_cycle = np.clip(np.floor(times * w / math.pi), 0, last).astype(np.intp)
        phase = times * w - math.pi * half_cycle
        moving = (times >= 0.0) & (half_cycle < last)
        point = self.turning_points[half_cycle]
        centre = np.copysign(self._rig.half_drop, point)
        swing = np.where(moving, point - centre, 0.0)
        if quantity == "displacement":
            return np.where(moving, centre + swing * np.cos(phase), point)
        if quantity == "velocity":
            return -w * swing * np.sin(phase)
        return -(w**2) * swing * np.cos(phase)

    def mean_friction(self, start: float, stop: float) -> float:
        """Friction [N] that acted along the path from ``start`` to ``stop`` [s]: the same everywhere."""
        return self._rig.friction
