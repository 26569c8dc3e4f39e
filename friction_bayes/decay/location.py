"""Where free decays lie in records: one in each, or several in one recording, from the data alone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.decay.located import (
    FOUND,
    LEAST_HALF_CYCLES,
    NOT_DECAYING,
    SEVERAL_DECAYS,
    SEVERAL_MODES,
    TOO_SHORT,
    Located,
)
from friction_bayes.decay.release_and_rest import locate_moving_parts
from friction_bayes.decay.releases import parts_between_releases
from friction_bayes.decay.spans import Extremes, extremes
from friction_bayes.decay.spectral_modes import spectral_modes
from friction_bayes.records.clipping import clipped_fraction
from friction_bayes.records.quantisation import quantisation_step

__all__ = ["DecayWithin", "decays_within", "locate_free_decays"]

_FASTER = 1.2
"""Times the declared frequency, above which a bend of so few half cycles passes for an oscillation."""
_OF_ONE_SYSTEM = 1.3
"""Most that the frequencies of two decays of one recording differ by, as a factor: swings may be large."""


class DecayWithin(NamedTuple):
    """One free decay of a recording.

    Attributes
    ----------
    part : slice
        The samples around it that hold no other.
    start, stop : int
        Its moving part, ``start <= i < stop``.
    half_cycles : int
    """

    part: slice
    start: int
    stop: int
    frequency: float

    @property
    def half_cycles(self) -> int:
        """Whole half cycles that it moves."""
        return int((self.stop - self.start) * self.frequency / math.pi)


def decays_within(
    values: Array, step: float, natural_frequency: float, order: int, resolution: float | None = None
) -> list[DecayWithin]:
    """Find the free decays of one recording, in order.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Samples.
    step, natural_frequency, order, resolution
        As for :func:`locate_free_decays`.
    """
    omega = float(spectral_modes(values[None], step * natural_frequency).frequency[0])
    decays = []
    for part in parts_between_releases(values, omega):
        one = np.ascontiguousarray(values[None, part])
        found = _locate(one, extremes(one), step, natural_frequency, order, -1, resolution, alone=True)
        if found.status[0] == FOUND:
            start, stop = int(found.start[0]), int(found.stop[0])
            frequency = float(found.frequency[0])
            decays.append(DecayWithin(part, part.start + start, part.start + stop, frequency))
    longest = max(decays, key=lambda decay: decay.half_cycles, default=None)
    # a hand that moves from one hold to another passes for three half cycles of a slow decay
    return [
        each
        for each in decays
        if longest and abs(math.log(each.frequency / longest.frequency)) < math.log(_OF_ONE_SYSTEM)
    ]


def locate_free_decays(
    values: Array,
    step: float,
    natural_frequency: float,
    order: int,
    start: int = -1,
    resolution: float | None = None,
    seen: Extremes | None = None,
) -> Located:
    """Find the moving parts of many records.

    Parameters
    ----------
    values : ndarray, shape (records, n)
        Samples, one record a row.
    step : float
        Sampling interval [s].
    natural_frequency : float
        Declared ``sqrt(k/m)`` [rad/s]: where to look.
    order : int
        Derivative order of the signal.
    start : int
        First sample of the free decay if known, else -1.
    resolution : float, optional
        Step of the sensor, unit of the signal; found record by record when left out.
    seen : Extremes, optional
        Of the records, where they are known.

    Returns
    -------
    Located
    """
    seen = extremes(values) if seen is None else seen
    located = _locate(values, seen, step, natural_frequency, order, start, resolution, alone=False)
    for row in np.flatnonzero(located.status == SEVERAL_DECAYS).tolist():
        after = values[row, max(start, 0) :]
        if len(decays_within(after, step, natural_frequency, order, resolution)) > 1:
            continue
        # what rises once more is no decay: a hand, or a push
        one = values[row : row + 1]
        alone = _locate(one, extremes(one), step, natural_frequency, order, start, resolution, alone=True)
        for field, found in zip(located, alone, strict=True):
            field[row] = found[0]
    return located


def _locate(
    values: Array,
    seen: Extremes,
    step: float,
    natural_frequency: float,
    order: int,
    start: int,
    resolution: float | None,
    *,
    alone: bool,
) -> Located:
    """Find the moving parts, of records that hold one decay each or are not ``alone`` known to."""
    modes = spectral_modes(values[:, max(start, 0) :], step * natural_frequency)
    records = values.shape[0]
    if resolution is None:
        resolutions = _tail_resolution(values, round(math.pi / (natural_frequency * step)))
    else:
        resolutions = np.full(records, resolution)
    located = Located(
        status=np.zeros(records, dtype=np.int64),
        start=np.zeros(records, dtype=np.int64),
        stop=np.zeros(records, dtype=np.int64),
        frequency=np.zeros(records),
        phase=np.zeros(records),
        rest_position=np.zeros(records),
        stops=np.zeros(records, dtype=np.bool_),
        disturbed=np.zeros(records, dtype=np.int64),
        driven=np.zeros(records, dtype=np.bool_),
    )
    locate_moving_parts(values, seen, modes.frequency, resolutions, order, start, alone, True, located)
    for row in np.flatnonzero(located.driven | (located.disturbed > 0)).tolist():
        if clipped_fraction(values[row])[1] is not None:
            # amplitudes beyond the sensor's range look alike, whatever acts
            one = slice(row, row + 1)
            own = Located._make(field[one] for field in located)
            locate_moving_parts(
                values[one],
                Extremes._make(field[one] for field in seen),
                modes.frequency[one],
                resolutions[one],
                order,
                start,
                alone,
                False,
                own,
            )
    # two modes that beat do not decay either, and are to be reported
    decided = (located.status == FOUND) | (located.status == NOT_DECAYING)
    located.status[decided & modes.several] = SEVERAL_MODES
    frequency = np.minimum(located.frequency, _FASTER * natural_frequency * step)
    brief = frequency * (located.stop - located.start) < LEAST_HALF_CYCLES * math.pi
    located.status[(located.status == FOUND) & brief] = TOO_SHORT
    return located


def _tail_resolution(values: Array, tail: int) -> Array:
    """Step of the sensor, shape (records,): zero where none shows, or where the record does not end still.

    A record that does repeats values in its last ``tail`` samples; it is looked for in those alone, as it
    takes time.
    """
    result = np.zeros(values.shape[0])
    if 0 < tail < values.shape[1]:
        ends = np.sort(values[:, -tail:], axis=1)
        distinct = 1 + np.count_nonzero(ends[:, 1:] > ends[:, :-1], axis=1)
        for row in np.flatnonzero(distinct <= tail // 2).tolist():
            result[row] = quantisation_step(values[row]) or 0.0
    return result
