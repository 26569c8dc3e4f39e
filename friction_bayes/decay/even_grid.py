"""Unevenly sampled records on an even grid: to find a decay in them, and for methods that need one."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.records.clock import GAP, LONGEST_BRIDGED_GAP

__all__ = ["even_grid"]

_AROUND_GAP = 0.25
"""Periods before and after a gap from which what is missing is filled in."""


def even_grid(time: Array, values: Array, frequency: float) -> tuple[Array, Array]:
    """Interpolate a signal onto an even grid over the same time, at the typical interval.

    A cubic spline; between two equal samples the value is kept, so that flat tops of a clipped sensor
    stay recognisable. Interpolation correlates the noise of neighbouring samples. Over a gap of several it
    would go by the noise of the two next to it: an oscillation by those of a quarter period is taken there.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Rising, without long gaps, see :func:`friction_bayes.records.clock.check_gaps` [s].
    values : ndarray, shape (n,)
        Samples, finite.
    frequency : float
        Rough angular frequency of the motion [rad/s].

    Returns
    -------
    time, values : ndarray, shape (m,)
        On the grid.
    """
    from scipy.interpolate import make_interp_spline

    intervals = np.diff(time)
    typical = float(np.median(intervals))
    # the mean where no sample is missing: the median keeps the rounding of the time stamps
    step = float(intervals[intervals <= GAP * typical].mean())
    grid = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / step) + 1)
    # a spline overshoots next to a flat top; nothing beyond the recorded range was seen
    even = np.clip(make_interp_spline(time, values, k=3)(grid), values.min(), values.max())
    left = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, time.size - 2)
    flat = values[left] == values[left + 1]
    even[flat] = values[left][flat]
    for k in np.flatnonzero(intervals > LONGEST_BRIDGED_GAP * typical):
        inside = (grid > time[k]) & (grid < time[k + 1])
        even[inside] = _oscillation(grid[inside], time, values, (time[k], time[k + 1]), frequency)
    return grid, even


def _oscillation(at: Array, time: Array, values: Array, gap: tuple[float, float], frequency: float) -> Array:
    """The oscillation that fits the samples next to a gap, by least squares, at times inside it."""
    middle, reach = 0.5 * (gap[0] + gap[1]), _AROUND_GAP * 2.0 * math.pi / frequency
    near = (time > gap[0] - reach) & (time < gap[1] + reach)

    def waves(t: Array) -> Array:
        angle = frequency * (t - middle)
        return np.column_stack([np.ones_like(t), np.sin(angle), 1.0 - np.cos(angle)])

    return np.asarray(waves(at) @ np.linalg.lstsq(waves(time[near]), values[near], rcond=None)[0])
