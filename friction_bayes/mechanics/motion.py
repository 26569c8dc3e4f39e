"""A computed motion: what the exact solution and the integrator both return."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.checks import finite_array
from friction_bayes.core.errors import InputError

__all__ = ["Motion", "sample_times"]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A free decay sampled over time.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Sample times [s]; the initial state belongs to ``time[0]``.
    displacement, velocity, acceleration : ndarray, shape (n,)
        In m, m/s and m/s2, or rad, rad/s and rad/s2. At a turning point the acceleration is that after
        the jump; it is zero while the system sticks.
    turning_times, turning_points : ndarray, shape (p,)
        Times [s] and displacements at which the velocity comes to zero within ``time[0] .. time[-1]``;
        a release from rest is the first of them, the stop the last.
    stop_time : float
        When the final rest begins [s]; infinite when the system still moves at ``time[-1]``.
    """

    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    turning_times: Array
    turning_points: Array
    stop_time: float = math.inf

    def derivative(self, order: int) -> Array:
        """Return displacement, velocity or acceleration for ``order`` 0, 1 or 2."""
        return (self.displacement, self.velocity, self.acceleration)[order]

    @property
    def moving(self) -> Mask:
        """Which samples lie before the final rest, shape (n,)."""
        return self.time < self.stop_time


def sample_times(time: ArrayLike) -> Array:
    """Return ``time`` as a float array, refusing what is no ascending sequence of finite numbers."""
    # always a copy: a read-only array, as xarray hands out, is another type to numba and compiles all anew
    times = np.array(finite_array("time", time))
    if times.ndim != 1 or times.size == 0:
        raise InputError("time", f"has shape {times.shape}", "give a one-dimensional, non-empty array")
    backwards = np.flatnonzero(np.diff(times) < 0.0)
    if backwards.size:
        raise InputError("time", f"runs backwards after sample {int(backwards[0])}", "sort the times")
    return times
