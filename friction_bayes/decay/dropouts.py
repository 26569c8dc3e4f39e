r"""Dropouts: runs of one value, up to a period, that the motion cannot have, as of a lost target.

The samples on either side of a run of equal ones fit an oscillation, which says where the run begins and
ends. Dropouts are anywhere within the range of the signal, others as far off as the fit usually is,

.. math:: p(d) = (1 - \epsilon)\, N(d; 0, \sigma^2) + \epsilon / R,

with ``d`` the distance less one step of the sensor and what the motion covers in one sample: where a sensor
is at the end of its range, sticks, or has but steps, a run ends where the motion goes on.
"""

from __future__ import annotations

import math
import warnings
from functools import lru_cache

import numpy as np
import xarray as xr
from scipy.special import ndtri

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.errors import RecordWarning
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.spans import has_repeats
from friction_bayes.records.clock import (
    LONGEST_BRIDGED_GAP,
    LONGEST_GAP_IN_PERIODS,
    place_of_sample,
    sampling_interval,
)
from friction_bayes.records.held_readings import least_step
from friction_bayes.records.quantisation import ROUNDING
from friction_bayes.records.record import record_name, with_values

__all__ = ["set_dropouts_aside", "without_dropouts"]

_FEW_RADIANS = 0.5 * math.pi
"""Over more, the amplitude is lower and the phase, by a declared frequency, off on the other side."""
_SHARE = 1e-5
"""Prior share of dropouts among runs of one value: twice as large, it moves the limit by 1/8 sd."""
_LEAST_SUPPORT = 4
"""Samples on either side that say where the motion was; as many as a longer run has."""
_FEWEST = 2
"""On one side, at an end of the record."""
_PLACES = 300
"""Places at which is looked how far off the fit usually is."""
_QUANTILE = 0.9
"""Of distances, by which their sd is known whatever dropouts there are."""


def without_dropouts(values: Array, angle: float) -> tuple[Array, Indices]:
    """Put in the place of dropouts the oscillation that the samples on either side fit.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite samples.
    angle : float
        Declared natural frequency [rad/sample].

    Returns
    -------
    mended : ndarray, shape (n,)
        The samples themselves where there are no dropouts.
    dropouts : ndarray of int, shape (k,)
        Which samples were replaced, ascending.
    """
    mended, dropped = values, np.zeros(values.size, np.bool_)
    # one may hide another next to it
    while has_repeats(mended):
        filled = _fill(mended, angle)
        if not (filled != mended).any():
            break
        dropped |= filled != mended
        mended = filled
    return mended, np.flatnonzero(dropped)


def set_dropouts_aside(record: xr.DataArray, system: Oscillator) -> tuple[xr.DataArray, Array]:
    """Return a record :func:`without_dropouts`, and their times [s], saying so.

    Parameters
    ----------
    record : xarray.DataArray
        A record that :func:`~friction_bayes.records.record.validate_record` has passed.
    system : Oscillator
        The declared system.

    Warns
    -----
    RecordWarning
        Naming them, where there are any.
    """
    values, time = np.asarray(record.values, dtype=np.float64), record["time"].values
    mended, dropouts = without_dropouts(values, system.natural_frequency * sampling_interval(record))
    if not dropouts.size:
        return record, time[dropouts]
    runs = 1 + np.count_nonzero(np.diff(dropouts) > 1)
    warnings.warn(
        f"{record_name(record)}: {dropouts.size} samples in {runs} {'run' if runs == 1 else 'runs'} of one "
        f"value each, far from the motion, the first from {place_of_sample(int(dropouts[0]), time)}: set "
        "aside as dropouts of the sensor",
        RecordWarning,
        stacklevel=3,
    )
    return with_values(record, mended), time[dropouts]


def _fill(values: Array, angle: float) -> Array:
    """The samples with the oscillation in the place of those dropouts that show."""
    filled = values.copy()
    longest = int(max(2.0 * math.pi * LONGEST_GAP_IN_PERIODS / angle, LONGEST_BRIDGED_GAP))
    first, lengths = _runs(values, longest)
    support = np.clip(lengths, _LEAST_SUPPORT, max(int(_FEW_RADIANS / angle), _LEAST_SUPPORT))
    before, after = np.minimum(support, first), np.minimum(support, values.size - first - lengths)
    may_be = (before >= _FEWEST) & (after >= _FEWEST) & (before + after >= 2 * _LEAST_SUPPORT - 1)
    kinds, which = np.unique(np.column_stack([lengths, before, after])[may_be], axis=0, return_inverse=True)
    for k, (length, ahead, behind) in enumerate(kinds.tolist()):
        own = first[may_be][which.ravel() == k]
        gap = _gap(length, ahead, behind, angle)
        own = own[gap.dropped(values, own)]
        for i, inside in zip(own.tolist(), gap.filled(values, own), strict=True):
            filled[i : i + length] = inside[1:-1]
    return filled


@njit(**KERNEL)
def _runs(values: Array, longest: int) -> tuple[Indices, Indices]:
    """First samples and lengths of runs of equal samples."""
    first, lengths = np.empty(values.size // 2, np.intp), np.empty(values.size // 2, np.intp)
    count, begin = 0, 0
    for i in range(1, values.size + 1):
        if i < values.size and values[i] == values[i - 1]:
            continue
        if 1 < i - begin <= longest:
            first[count], lengths[count] = begin, i - begin
            count += 1
        begin = i
    return first[:count], lengths[:count]


class _Gap:
    """What the samples on either side say of those between, by the oscillation that fits them best.

    Its columns are 1, sin and (1 - cos), which stay apart however small the angle is; over a longer gap the
    size of the latter two changes evenly.
    """

    def __init__(self, length: int, before: int, after: int, angle: float) -> None:
        at = np.arange(-before, length + after)
        phase = angle * (at - 0.5 * (length - 1))
        columns = np.column_stack([np.ones_like(phase), np.sin(phase), 2.0 * np.sin(0.5 * phase) ** 2])
        if angle * length > _FEW_RADIANS:
            columns = np.column_stack([columns, phase[:, None] * columns[:, 1:]])
        columns /= np.abs(columns).max(axis=0)
        outside = (at < 0) | (at >= length)
        self.around = at[outside]
        self.length = length
        self.inverse = np.linalg.pinv(columns[outside])
        self.outside = columns[outside]
        self.inside = columns[before - 1 : before + length + 1]

    def filled(self, values: Array, first: Indices) -> Array:
        """From one sample before the gaps that begin at ``first`` to one behind, shape (gaps, length + 2)."""
        return np.asarray(values[first[:, None] + self.around] @ self.inverse.T @ self.inside.T)

    def dropped(self, values: Array, first: Indices) -> Mask:
        """Which of the gaps' samples have rather dropped out of the motion, shape (gaps,)."""
        low, high = float(values.min()), float(values.max())
        level = values[first][:, None]
        away, covered, own_sd = self._distances(values, first)
        # beyond the ends of its range a sensor shows nothing
        beyond = ((level == high) & (away < 0.0)) | ((level == low) & (away > 0.0))
        distance = np.where(beyond, 0.0, np.abs(away) - covered).max(axis=1)
        dropped = _rather_dropped(distance, own_sd, high - low)
        if dropped.any():
            places = np.arange(-self.around[0], values.size - self.around[-1])
            usual, _, _ = self._distances(values, places[:: max(places.size // _PLACES, 1)])
            usual_sd = np.quantile(np.abs(usual), _QUANTILE) / float(ndtri(0.5 + 0.5 * _QUANTILE))
            distance -= least_step(values)
            dropped = _rather_dropped(distance, np.maximum(usual_sd, own_sd), high - low)
        return dropped

    def _distances(self, values: Array, first: Indices) -> tuple[Array, Array, Array]:
        """How far the ends of gaps are off, what the motion covers there in a sample, and the sd around.

        Shapes (gaps, 2), (gaps, 2) and (gaps,).
        """
        around, inside = values[first[:, None] + self.around], self.filled(values, first)
        ends = np.column_stack([values[first], values[first + self.length - 1]])
        away = ends - inside[:, [1, -2]]
        covered = np.abs(inside[:, [0, -1]] - inside[:, [1, -2]])
        off = around - around @ self.inverse.T @ self.outside.T
        variance = np.sum(off**2, axis=1) / (self.around.size - self.outside.shape[1])
        leverage = np.sum((self.inside @ self.inverse) ** 2, axis=1).max()
        return away, covered, np.sqrt(variance * (1.0 + leverage))


@lru_cache(maxsize=1000)
def _gap(length: int, before: int, after: int, angle: float) -> _Gap:
    return _Gap(length, before, after, angle)


def _rather_dropped(distance: Array, sd: Array, span: float) -> Mask:
    """Whether samples are rather anywhere within the range than as far off as the fit, shape (gaps,)."""
    sd = sd + ROUNDING * span
    log_odds = np.log(_SHARE * math.sqrt(2.0 * math.pi) * sd / span)
    return np.asarray(log_odds + 0.5 * (np.maximum(distance, 0.0) / sd) ** 2 > 0.0)
