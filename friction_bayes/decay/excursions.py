"""Isolated excursions: wild samples and a logger's marks for missing ones, set aside before any fit.

An excursion lasts a few samples and leads out of the motion by more than its amplitude. What is less, the
noise of a sensor and its tails, is left to the model of the noise; what lasts longer is no stray sample.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.running_ranks import ranks_of_seven
from friction_bayes.decay.spans import Extremes
from friction_bayes.records.clock import LOST, place_of_sample, sampling_interval
from friction_bayes.records.record import record_name, with_values

__all__ = ["excursions_possible", "set_excursions_aside", "without_excursions"]

_OUT_OF_MOTION = 0.5
"""Share of the motion's range, from top to bottom, that an excursion exceeds."""
_OUT_OF_NOISE = 6.0
"""Times the median distance of a sample from the median around it, that it exceeds too."""
_AROUND = 10
"""Samples to either side that show how far the motion goes there, even if a period has three."""
_REACH = 0.8
"""Share of those that go no farther; the others may be excursions too."""
_OUT_OF_REACH = 1.5
"""Times as far as those go, that an excursion exceeds too."""
_MOST_MARKS = 0.2
"""Share of the samples that may be marks of missing ones; more are part of the signal."""
_SUPPORT = 4
"""Nearest other samples that say where the motion was, half of them on either side; at an end of the record
it takes up to half a period."""


def excursions_possible(seen: Extremes) -> Mask:
    """Which records :func:`without_excursions` may find any in, shape (records,); none that are not finite.

    The median of seven is no farther from their middle one than the samples up to three apart are from each
    other, and no farther from the highest and the lowest.
    """
    finite = seen.finite
    span = np.where(finite, seen.high - seen.low, np.inf)
    return np.asarray(finite & (seen.widest > _OUT_OF_MOTION / (1.0 + 2.0 * _OUT_OF_MOTION) * span))


def without_excursions(values: Array, angle: float) -> tuple[Array, Indices]:
    """Put in the place of isolated excursions what the samples next to them say of the motion.

    A sample is one by its distance from the median of the few around it, as by Hampel's criterion: next to
    the range of the whole motion, the noise, and how far the samples around go, so that where a motion is
    fast or coarsely sampled only an excursion out of its range counts. What takes its place is, at its time,
    the oscillation at the declared frequency, about any rest position, that fits the samples next to it: from
    two on either side it scatters like a sample, so that nothing is known the better for it.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples.
    angle : float
        Declared natural frequency [rad/sample].

    Returns
    -------
    mended : ndarray, shape (n,)
        The samples themselves where there are no excursions.
    excursions : ndarray of int, shape (k,)
        Which samples were replaced.
    """
    # an excursion lasts fewer than half of the seven
    _, middle, _ = ranks_of_seven(values)
    away = np.abs(values - middle)
    least = _OUT_OF_MOTION * float(np.ptp(middle))
    if away.max() <= least:
        return values, np.zeros(0, dtype=np.intp)
    least += _OUT_OF_NOISE * float(np.median(away))
    suspects = np.flatnonzero(away > least)
    span = np.arange(min(2 * _AROUND + 1, values.size))
    around = np.clip(suspects - _AROUND, 0, values.size - span.size)[:, None] + span
    reach = np.quantile(np.abs(values[around] - middle[suspects, None]), _REACH, axis=1)
    stray = suspects[away[suspects] > least + _OUT_OF_REACH * reach]
    others = np.delete(np.arange(values.size), stray)
    if not stray.size or others.size < _SUPPORT:
        return values, stray[:0]
    mended = values.copy()
    for i in stray.tolist():
        near = _nearest(others, i, angle)
        mended[i] = _oscillation_at(i, near, values[near], angle)
    return mended, stray


def set_excursions_aside(record: xr.DataArray, system: Oscillator) -> tuple[xr.DataArray, Indices]:
    """Return a record :func:`without_excursions` and where they were, saying so.

    Parameters
    ----------
    record : xarray.DataArray
        A record that :func:`~friction_bayes.records.record.validate_record` has passed.
    system : Oscillator
        The declared system.

    Raises
    ------
    InputError
        If samples lie far out of the motion for longer than an excursion.

    Warns
    -----
    RecordWarning
        Naming them, where there are any.
    """
    values = np.asarray(record.values, dtype=np.float64)
    mended, stray = without_excursions(values, system.natural_frequency * sampling_interval(record))
    _refuse_marks(record, mended)
    if not stray.size:
        return record, stray
    first = f"{values[stray[0]]:g} {record.attrs.get('units', '')} at "
    first += place_of_sample(int(stray[0]), record["time"].values)
    count = "1 sample leaps" if stray.size == 1 else f"{stray.size} samples leap"
    warnings.warn(
        f"{record_name(record)}: {count} out of the motion, the first to {first}: set aside as outliers or "
        "marks of missing samples",
        RecordWarning,
        stacklevel=3,
    )
    return with_values(record, mended), stray


def _refuse_marks(record: xr.DataArray, values: Array) -> None:
    """Refuse samples beyond a gap as wide as the range of all others, such as a logger's -9.99 for none."""
    levels = np.sort(values)
    gap = int(np.diff(levels).argmax())
    low, high = levels[gap], levels[gap + 1]
    for beyond, between in ((values >= high, low - levels[0]), (values <= low, levels[-1] - high)):
        if high - low > between and np.mean(beyond) < _MOST_MARKS:
            first = int(np.flatnonzero(beyond)[0])
            place = place_of_sample(first, record["time"].values)
            raise InputError(
                record_name(record),
                f"{np.count_nonzero(beyond)} samples lie far out of the motion, the first {values[first]:g} "
                f"{record.attrs.get('units', '')} at {place}, as marks of missing samples do",
                LOST,
            )


def _nearest(others: Indices, i: int, angle: float) -> Indices:
    """Those of ``others``, in order, that are nearest to sample ``i``; more where all lie on one side."""
    place = int(np.searchsorted(others, i))
    inside = _SUPPORT // 2 <= place <= others.size - _SUPPORT // 2
    count = _SUPPORT if inside else min(max(int(math.pi / angle), _SUPPORT), 2 * _AROUND)
    near = others[max(place - count, 0) : place + count]
    return np.asarray(near[np.argsort(np.abs(near - i), kind="stable")[:count]])


def _oscillation_at(i: int, near: Indices, values: Array, angle: float) -> float:
    """Value at sample ``i`` of the oscillation that fits ``values`` at samples ``near``, by least squares.

    Its columns are 1, sin and (1 - cos), which stay apart however small the angle is.
    """
    phase = angle * (near - i)
    columns = np.column_stack([np.ones_like(phase), np.sin(phase), 2.0 * np.sin(0.5 * phase) ** 2])
    columns[:, 1:] /= np.abs(columns[:, 1:]).max(axis=0) + math.ulp(0.0)
    return float(np.linalg.lstsq(columns, values, rcond=None)[0][0])
