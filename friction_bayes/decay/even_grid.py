"""Unevenly sampled records on an even grid: to find a decay in them, and for methods that need one."""

from __future__ import annotations

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.records.clock import GAP

__all__ = ["even_grid"]


def even_grid(time: Array, values: Array) -> tuple[Array, Array]:
    """Interpolate a signal onto an even grid over the same time, at the typical interval.

    A cubic spline; between two equal samples the value is kept, so that flat tops of a clipped sensor
    stay recognisable. Interpolation correlates the noise of neighbouring samples.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Rising, without long gaps, see :func:`friction_bayes.records.clock.check_clock` [s].
    values : ndarray, shape (n,)
        Samples, finite.

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
    # a spline overshoots beside a flat top; nothing beyond the recorded range was seen
    even = np.clip(make_interp_spline(time, values, k=3)(grid), values.min(), values.max())
    left = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, time.size - 2)
    flat = values[left] == values[left + 1]
    even[flat] = values[left][flat]
    return grid, even
