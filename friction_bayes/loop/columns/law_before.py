"""The law of the round before and its sensor effects, about which the columns of the next are linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.columns.effect_columns import NUDGE, ForceColumn, Sampled, SensorColumn
from friction_bayes.statespace.measured_path import MeasuredPath, Points
from friction_bayes.statespace.response import Feedback

__all__ = ["LawBefore"]


@dataclass(frozen=True, eq=False)
class LawBefore:
    """A law about which others are linear.

    Attributes
    ----------
    forces : tuple of (float, ForceColumn)
        Those that act, and their coefficients.
    of_sensor : tuple of (float, SensorColumn)
        The sensor effects, and their coefficients.
    fluctuation : ndarray, shape (n,)
        The random force at the samples; it does not depend on the motion.
    """

    forces: tuple[tuple[float, ForceColumn], ...]
    of_sensor: tuple[tuple[float, SensorColumn], ...]
    fluctuation: Array

    def gain(self, read: Sampled) -> Array:
        """A change of the signal as read by the sensor with its effects, shape (n,)."""
        gain = np.ones(read.phase.size // read.block)
        for size, each in self.of_sensor:
            gain += size * each.slope(read)
        return gain

    def force(self, points: Points) -> Array:
        """Its force that depends on the motion, shape (m,)."""
        return sum((size * each.force(points) for size, each in self.forces), np.zeros(points.x.size))

    def feedback(self, path: MeasuredPath) -> Feedback:
        """How its force changes with the motion along a path."""
        nudge = NUDGE * float(np.max(np.abs(path.x)))

        def slopes(points: Points, straight: Array) -> Array:
            by_x, by_v = (
                self.force(points._replace(**{name: getattr(points, name) + nudge}))
                - self.force(points._replace(**{name: getattr(points, name) - nudge}))
                for name in ("x", "v")
            )
            # the part of the restoring force that the linear oscillator lacks
            bent = straight - (np.cos(points.x) if path.pendulum else 1.0)
            return np.column_stack([bent + by_x / (2.0 * nudge), by_v / (2.0 * nudge)])

        return Feedback(
            slopes(path.nodes, path.stiffness[path.interval]),
            slopes(path.samples, path.slope),
            self._passed(path),
        )

    def _passed(self, path: MeasuredPath) -> Array:
        """Acceleration after each turning point over the one before it; none where the mass would stick."""
        turning, x = path.turning, path.turning_x
        sample = np.searchsorted(path.phase, turning) - 1
        towards = np.where(path.v[sample] > 0.0, 1.0, -1.0)
        rest = np.interp(turning, path.phase, self.fluctuation) - path.restoring(x)
        still = np.zeros(turning.size)
        before, after = (rest + self.force(Points(turning, x, still, side)) for side in (towards, -towards))
        # it is against the motion before; friction, which resists, makes it smaller after
        share = np.divide(after, before, out=np.zeros(turning.size), where=before * towards < 0.0)
        return np.clip(share, 0.0, 1.0)
