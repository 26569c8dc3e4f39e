"""Unevenly sampled records on an even grid: to find a decay in them, and for methods that need one."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.decay.block_means import samples_in_block
from friction_bayes.records.clock import GAP, LONGEST_BRIDGED_GAP

__all__ = ["even_grid", "filled_in", "places_on_grid"]

_ON_GRID = 0.05
"""Share of the step within which samples lie on an even grid."""
_AROUND_GAP = 0.25
"""Periods before and after a gap from which what is missing is filled in."""
_AROUND_LONG_GAP = 0.5
"""Likewise where it is longer than that: friction goes either way in a whole one."""


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


def places_on_grid(time: Array) -> Indices:
    """Places of samples on an even grid from which some are missing, the first zero, shape (n,).

    Where they lie on no such grid, only long gaps have places for what is missing in them.
    """
    intervals = np.diff(time)
    apart = intervals / np.median(intervals)
    whole = np.rint(apart)
    index = np.append(0, np.cumsum(whole)).astype(np.intp)
    step = (time[-1] - time[0]) / index[-1]
    if np.any(np.abs(time - time[0] - step * index) > _ON_GRID * step) or np.any(whole < 1.0):
        whole[apart <= LONGEST_BRIDGED_GAP] = 1.0
        index = np.append(0, np.cumsum(whole)).astype(np.intp)
    return index


def filled_in(time: Array, values: Array, frequency: float) -> tuple[Array, Array, Mask]:
    """Fill what is missing of an even grid, or long gaps without one, by an oscillation.

    Parameters
    ----------
    time, values, frequency
        As for :func:`even_grid`.

    Returns
    -------
    time, values : ndarray, shape (m,)
        With the others where they are.
    filled : ndarray of bool, shape (m,)
        Which samples were not recorded.
    """
    index = places_on_grid(time)
    whole = np.interp(np.arange(index[-1] + 1), index, time)
    filled = np.ones(whole.size, np.bool_)
    filled[index] = False
    mended = np.empty(whole.size)
    mended[index] = values
    gaps = np.diff(index)
    block = samples_in_block(2.0 * math.pi / frequency * index[-1] / (time[-1] - time[0]))
    if block > 1:
        # over as little as is averaged, the motion goes straight from neighbour to neighbour
        mended = np.interp(np.arange(whole.size), index, values)
        gaps[gaps <= block] = 1
    for k in np.flatnonzero(gaps > 1).tolist():
        inside = slice(index[k] + 1, index[k + 1])
        mended[inside] = _oscillation(whole[inside], time, values, (time[k], time[k + 1]), frequency)
    # a top may be missing, and higher than any that was recorded: within twice their range
    middle, swing = 0.5 * (values.max() + values.min()), np.ptp(values)
    return whole, np.clip(mended, middle - swing, middle + swing), filled


def _oscillation(at: Array, time: Array, values: Array, gap: tuple[float, float], frequency: float) -> Array:
    """The oscillation that fits the samples next to a gap, by least squares, at times inside it.

    Across more than half a half cycle its amplitude and phase change along a line.
    """
    middle, period = 0.5 * (gap[0] + gap[1]), 2.0 * math.pi / frequency
    long = gap[1] - gap[0] > _AROUND_GAP * period
    reach = _AROUND_LONG_GAP * period if long else _AROUND_GAP * period
    near = slice(*np.searchsorted(time, [gap[0] - reach, gap[1] + reach]))

    def waves(t: Array) -> Array:
        angle = frequency * (t - middle)
        columns = [np.ones_like(t), np.sin(angle), 1.0 - np.cos(angle)]
        if long:
            columns += [angle * np.sin(angle), angle * np.cos(angle)]
        return np.column_stack(columns)

    return np.asarray(waves(at) @ np.linalg.lstsq(waves(time[near]), values[near], rcond=None)[0])
