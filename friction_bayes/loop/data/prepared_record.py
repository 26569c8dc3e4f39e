r"""The part of a record that is fitted: from release to just beyond the stop, cut once, before any model.

Samples at the start may have been read while the mass was still held. A release from rest leaves a position
that is even in the time since, whatever friction and spring,

.. math:: x = a + b \cos \omega s + c \cos 2 \omega s, \quad s = t - t_0,

over the first half cycle, and a constant before. A record that begins in motion has the odd terms too, and no
hold. Both are fitted to the first half period and compared by their likelihood at the most probable noise. A
priori one record in ten has a hold, and it ends at any sample within a quarter of a period. An
acceleration is not tested: its jump at the release is visible, and alike those at turning points.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.ndimage import binary_dilation, median_filter

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError, RecordWarning, of_each
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.block_means import (
    amplitude_kept,
    block_means,
    samples_in_block,
    variance_by_share,
)
from friction_bayes.decay.dropouts import set_dropouts_aside
from friction_bayes.decay.even_grid import filled_in
from friction_bayes.decay.excursions import set_excursions_aside
from friction_bayes.decay.free_decay import FreeDecay, find_free_decay
from friction_bayes.decay.pendulum_likeness import pendulum_notes
from friction_bayes.decay.phase_tracking import nearest_turning_points
from friction_bayes.estimators.noise.smooth_curve import LOG_ODDS_NOT_FREE
from friction_bayes.estimators.waveform.early_rest import may_rest_early, until_rest
from friction_bayes.estimators.waveform.estimator import white_noise_fit
from friction_bayes.estimators.waveform.free_part import free_part
from friction_bayes.estimators.waveform.saturation import refuse_saturated
from friction_bayes.loop import settings
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.clock import check_gaps, sampling_interval
from friction_bayes.records.quantisation import ROUNDING, quantisation_step
from friction_bayes.records.readings_alone import readings_alone
from friction_bayes.records.record import validate_record
from friction_bayes.records.rounded_stamps import with_even_stamps
from friction_bayes.records.starting_over import while_going_on

__all__ = ["Segment", "cut_records", "held_samples", "rather_free"]

_NEIGHBOURS = 7
_FINENESS = 8
"""Number of release times that are tried between two samples."""
_HARMONICS = np.array([1.0, 2.0])
"""A half cycle of a far swing, or on a spring that stiffens, has the second too."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """The samples of one record that every model is fitted to.

    Attributes
    ----------
    decay : FreeDecay
        The moving part: rough frequency and phase, unit, quantity.
    values : ndarray, shape (n,)
        Samples as recorded.
    time : ndarray, shape (n,)
        Seconds since the first of them.
    sides : ndarray, shape (n,)
        1 and -1 where the sample lies flat at the upper and lower end of the sensor's range, else 0.
    measured : ndarray, shape (n,)
        Share of the samples of each value that were recorded and not set aside.
    near_jumps : ndarray of bool, shape (n,)
        Measured, but not fitted where the acceleration jumps: its sample nearest to each turning point, which
        may be on either side of the jump; of means of blocks, which may average both sides, the neighbours
        too.
    moving : int
        Samples before the stop.
    duration : float
        How long the mass of the whole record moves [s], to which friction drift refers.
    first : int
        Which of the kept samples is the first.
    kept : ndarray of bool, shape (recorded,)
        Samples of the record that do not repeat a reading that was held.
    filled : ndarray of bool, shape (m,)
        Of the kept samples and those put into gaps, which are the latter; these are not fitted.
    block : int
        Samples of the record that each value is the mean of.
    resolution : float or None
        Step of the digitiser or encoder, unit of the signal; None where none shows.
    held : int
        Values before the first of them that were read before the release.
    disturbed : int
        Half cycles at its start whose amplitudes do not fit the others: a hand, or only damping.
    """

    decay: FreeDecay
    values: Array
    time: Array
    sides: Array
    measured: Array
    near_jumps: Mask
    moving: int
    duration: float
    first: int
    kept: Mask
    filled: Mask
    block: int
    resolution: float | None = None
    held: int = 0
    disturbed: int = 0

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the record and on what was done to it before any model."""
        pendulum = pendulum_notes(self.decay)
        notes = pendulum + self.decay.notes
        far = self.decay.far_from_declared(self.decay.frequency)
        if far and not pendulum:
            notes += (f"{self.decay.name}: {self.decay.both_frequencies(self.decay.frequency)}: {far}",)
        if self.held:
            notes += (
                f"{self.decay.name}: held or touched at first, or a sensor was settling: the "
                f"{self.held * self.block} samples before the release, until {self.decay.start_time:.4g} s, "
                "are left out",
            )
        if self.block > 1:
            notes += (
                f"{self.decay.name}: averaged in blocks of {self.block} samples, as a period holds so many; "
                "the noise of the sensor is that of a sample, residuals and forecast errors are of the means",
            )
        return notes

    @property
    def least_noise(self) -> float:
        """Sd of the rounding to whole steps, a value, unit of the signal; zero where no step shows."""
        return (self.resolution or 0.0) / math.sqrt(12.0 * self.block)

    def of_record(self, values: Array) -> Array:
        """Another quantity of the same record, shape (recorded,), at the segment's samples."""
        at = np.arange(self.filled.size)
        whole = np.interp(at, at[~self.filled], values[self.kept])
        used = whole[self.first : self.first + self.block * self.values.size]
        return block_means(used, self.block)

    @property
    def in_gaps(self) -> Mask:
        """Values of samples none of which were recorded, shape (n,)."""
        used = self.filled[self.first : self.first + self.block * self.values.size]
        return np.asarray(used.reshape(-1, self.block).all(axis=1))

    @property
    def variance(self) -> Array:
        """Of the noise relative to that of a value all of which was measured, shape (n,)."""
        return variance_by_share(self.measured)

    @property
    def clipped(self) -> bool:
        """Whether the sensor has run into an end of its range."""
        return bool(self.sides.any())

    @property
    def ignored(self) -> Mask:
        """Not fitted: isolated excursions, dropouts, what was put into gaps, and ``near_jumps``, (n,)."""
        return np.asarray((self.measured == 0.0) | self.near_jumps)

    @property
    def free(self) -> Mask:
        """Samples that show the signal with noise, shape (n,)."""
        return np.asarray((self.sides == 0.0) & ~self.ignored)

    @property
    def order(self) -> int:
        """Derivative order of the signal."""
        return self.decay.quantity.order

    def only(self, free: FreeDecay, record: xr.DataArray, system: Oscillator) -> Segment:
        """The same of its record, which is not clipped, while it is free: it was held before, or stopped."""
        half = 0.5 * self.decay.step
        if free.earlier:
            record = record[record["time"].values < free.start_time + free.duration + half]
        with warnings.catch_warnings():
            # said when it was cut first
            warnings.simplefilter("ignore", RecordWarning)
            again = _cut(record, system, free_from=free.start_time - half if free.later else None)
        kept = np.zeros_like(self.kept)
        kept[: again.kept.size] = again.kept
        held = self.held + round((again.decay.start_time - self.decay.start_time) / self.decay.step)
        decay = replace(again.decay, earlier=free.earlier)
        return replace(again, decay=decay, kept=kept, held=held, sides=np.zeros_like(again.sides))

    def head(self, n: int) -> Segment:
        """The first ``n`` samples; time and phase are the same."""
        return replace(
            self,
            values=self.values[:n],
            time=self.time[:n],
            sides=self.sides[:n],
            measured=self.measured[:n],
            near_jumps=self.near_jumps[:n],
            moving=min(self.moving, n),
        )


def cut_records(records: Sequence[xr.DataArray], system: Oscillator) -> tuple[Segment, ...]:
    """The part of each record that is fitted; records that do not belong together are refused.

    Raises
    ------
    InputError
        If there is no record, a record is unusable, as where tops are flat below noise, or records hold
        different quantities or units.
    """
    if not records:
        raise InputError("records", "none given", "give at least one record")
    segments = tuple(of_each(lambda record: _cut(record, system), records))
    first = segments[0].decay
    for segment in segments[1:]:
        decay = segment.decay
        if (decay.quantity, decay.unit) != (first.quantity, first.unit):
            raise InputError(
                decay.name,
                f"holds {decay.quantity.name} [{decay.unit}], "
                f"{first.name} {first.quantity.name} [{first.unit}]",
                "close the loop on records of one quantity",
            )
    return segments


def rather_free(segment: Segment) -> FreeDecay | None:
    """The part in which a segment is free, as :func:`friction_bayes.estimate` finds it; None where it all is.

    Something may have held the mass before, or stopped it, as a hand does. A clipped record is not judged.
    """
    if segment.clipped:
        return None
    decay = segment.decay
    ignored = np.zeros(decay.values.size, np.bool_)
    ignored[: segment.moving] = segment.ignored[: segment.moving]
    try:
        free = free_part(
            decay.without_stray(ignored), white_noise_fit(decay), suspect=max(segment.disturbed, 1)
        ).decay
    except InputError:
        return None
    return free if free.later or free.earlier else None


def _cut(record: xr.DataArray, system: Oscillator, *, free_from: float | None = None) -> Segment:
    """The part of one record that is fitted, from where it is known to be free [s]."""
    validate_record(record)
    record, dropouts = set_dropouts_aside(with_even_stamps(while_going_on(record)), system)
    record, kept = readings_alone(record, system.natural_frequency)
    record, excursions = set_excursions_aside(record, system)
    stray = np.append(excursions, np.flatnonzero(np.isin(record["time"].values, dropouts)))
    check_gaps(record, system.natural_frequency)
    readings = record.values
    resolution, clips = quantisation_step(readings), clipped_fraction(readings)[1] is not None
    record, filled = _filled_in(record, system, within=clips)
    not_fitted = filled.copy()
    not_fitted[np.flatnonzero(~filled)[stray]] = True
    record, block = (record, 1) if clips else _averaged(record, filled, system)
    values = np.ascontiguousarray(record.values, dtype=np.float64)
    decay = find_free_decay(record, system, start=free_from, resolution=resolution)
    if disturbed := decay.disturbed:
        whole = max(decay.start_time - decay.disturbed * math.pi / decay.frequency, float(record["time"][0]))
        decay = find_free_decay(record, system, start=whole, resolution=resolution)
    before_release = 0 if clips or free_from is not None else held_samples(decay)
    if before_release:
        start = decay.start_time + before_release * decay.step
        decay = find_free_decay(record, system, start=start, resolution=resolution)
    if not clips:
        # noise on top of a flat top leaves no samples at one value, which are all that can be censored
        refuse_saturated(decay)
        decay = _until_rest(decay)
    clock = np.asarray(record["time"].values, dtype=np.float64)
    first = int(np.searchsorted(clock, decay.start_time))
    moving = decay.values.size
    rest = round(settings.SETTINGS.rest_kept * moving) if decay.stops else 0
    n = min(values.size - first, moving + rest)
    used = values[first : first + n]
    measured = 1.0 - block_means(not_fitted[block * first : block * (first + n)].astype(np.float64), block)
    sides = np.where(measured > 0.0, _sides(readings, used), 0.0) if clips else np.zeros(n)
    near_jumps = np.zeros(n, np.bool_)
    if decay.quantity.order == 2:
        near = nearest_turning_points(decay)
        # damping moves the jump from the extremum of the signal, by a phase of twice its ratio
        near_jumps[: min(moving, n)] = (near if block == 1 else binary_dilation(near))[:n]
        near_jumps &= measured > 0.0
    even = decay.step * np.arange(n, dtype=np.float64)
    time = even if decay.evenly_spaced else clock[first : first + n] - clock[first]
    return Segment(
        decay=decay,
        values=used,
        time=time,
        sides=sides,
        measured=measured,
        near_jumps=near_jumps,
        moving=min(moving, n),
        duration=float(decay.step * min(moving, n)),
        first=first * block,
        kept=kept,
        filled=filled,
        block=block,
        resolution=resolution,
        held=before_release,
        disturbed=disturbed,
    )


def _until_rest(decay: FreeDecay) -> FreeDecay:
    """The decay up to where its mass rather rests; itself where it cannot be fitted."""
    if not may_rest_early(decay):
        return decay
    try:
        return until_rest(decay, white_noise_fit(decay)(decay))
    except InputError:
        return decay


def _sides(readings: Array, used: Array) -> Array:
    """Which of the values used, shape (n,), lie flat at the upper (1) or lower end (-1) of all readings."""
    sides = np.zeros(used.size)
    # the sensor's range may be symmetric or not: an end is clipped where it is held
    for side, end in ((1.0, readings.max()), (-1.0, readings.min())):
        held = np.abs(used - end) <= ROUNDING * np.ptp(readings)
        if np.count_nonzero(held) > 3:
            sides[held] = side
    return sides


def _filled_in(record: xr.DataArray, system: Oscillator, *, within: bool) -> tuple[xr.DataArray, Mask]:
    """The record without gaps, and which samples were put into them, ``within`` the range of the others."""
    time, values = (np.asarray(each, dtype=np.float64) for each in (record["time"].values, record.values))
    low, high = values.min(), values.max()
    time, values, filled = filled_in(time, values, system.natural_frequency)
    if not filled.any():
        return record, filled
    if within:
        values = np.clip(values, low, high)
    stamps = {"time": ("time", time, record["time"].attrs)}
    return xr.DataArray(values, coords=stamps, attrs=record.attrs), filled


def _outliers_matter(values: Array, filled: Mask, angle: float) -> bool:
    """Whether a good part of the noise is that of a few readings, which means of blocks would spread.

    They show by their distance from the median of their neighbours, from which the motion, with ``angle``
    from sample to sample, deviates at its turning points by itself.
    """
    smooth = median_filter(values, _NEIGHBOURS, mode="nearest")
    away = np.abs(values - smooth)[~filled]
    spread = 1.4826 * float(np.median(away))
    if spread <= ROUNDING * np.ptp(values):
        # most samples equal their neighbours: the rest are steps of a digitiser
        return False
    swing = 0.5 * float(np.ptp(smooth))
    turns = swing * (1.0 - math.cos(min(angle * (_NEIGHBOURS // 2), math.pi)))
    outliers = away[away > settings.SETTINGS.far * spread + turns]
    return float(outliers @ outliers) > settings.SETTINGS.minor_share * float(away @ away)


def _averaged(record: xr.DataArray, filled: Mask, system: Oscillator) -> tuple[xr.DataArray, int]:
    """Means of blocks of samples, some of them ``filled`` in, and how many each is of.

    Outliers can be detected only sample by sample.
    """
    values = np.asarray(record.values, dtype=np.float64)
    clock = np.asarray(record["time"].values, dtype=np.float64)
    samples = 2.0 * math.pi / (system.natural_frequency * sampling_interval(record))
    block = samples_in_block(samples)
    # less than a period is refused as such, not for having too few means of blocks
    if block == 1 or samples > values.size:
        return record, 1
    if _outliers_matter(values, filled, 2.0 * math.pi / samples):
        return record, 1
    means = block_means(values, block)
    stamps = {"time": ("time", block_means(clock, block), record["time"].attrs)}
    means = means / amplitude_kept(samples, block)
    return xr.DataArray(means, coords=stamps, attrs=record.attrs), block


def held_samples(decay: FreeDecay) -> int:
    """Number of samples read before the release; zero also where the record cannot show it."""
    order = decay.quantity.order
    if order == 2 or not decay.evenly_spaced or decay.disturbed:
        return 0
    angle = decay.frequency * decay.step
    values = decay.values[: int(math.pi / angle) + 1]
    time: Array = angle * np.arange(values.size, dtype=np.float64)
    longest = values.size // 2
    in_motion = np.column_stack([np.ones_like(time), _terms(time, 0), _terms(time, 1)])
    if values.size < 2 * in_motion.shape[1]:
        return 0
    least = values.size * (ROUNDING * float(np.ptp(decay.values))) ** 2
    releases = np.arange(1, longest * _FINENESS + 1) / _FINENESS
    misfits = [_misfit(_released(time - angle * at, order), values) for at in releases]
    best = int(np.argmin(misfits))
    gain = 0.5 * values.size * math.log((_misfit(in_motion, values) + least) / (misfits[best] + least))
    return math.ceil(releases[best]) if gain + LOG_ODDS_NOT_FREE > math.log(longest) else 0


def _released(since: Array, order: int) -> Array:
    """Columns of a sensor's reading of a derivative, ``since`` in radians, for a mass held until zero."""
    moving = np.maximum(since, 0.0)
    return np.column_stack([np.ones_like(since), _terms(moving, order)])


def _terms(angle: Array, derivative: int) -> Array:
    """Terms of the motion that are even in time, or their derivative, shape (n, harmonics)."""
    turned = angle[:, None] * _HARMONICS
    return np.asarray(np.sin(turned) if derivative == 1 else np.cos(turned))


def _misfit(columns: Array, values: Array) -> float:
    """Residual sum of squares of a regression."""
    left = values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(left @ left)
