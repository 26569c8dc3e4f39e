"""The moving part of a record: where the free decay starts and stops, its rest position and rough phase."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.checks import finite
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import Quantity
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.located import CONSTANT, FOUND, NO_OSCILLATION, NOT_FINITE, TOO_SHORT, Located
from friction_bayes.decay.release_and_rest import locate_moving_parts
from friction_bayes.records.clock import sampling_interval
from friction_bayes.records.quantisation import quantisation_step
from friction_bayes.records.record import record_name, record_quantity

__all__ = ["FreeDecay", "find_free_decay", "locate_free_decays"]

_BAND = 3.0
"""The frequency is sought within this factor of the declared natural frequency."""
_SAMPLES_PER_PERIOD = 8.0
"""Of the fastest oscillation looked for; faster sampling is averaged first."""


@dataclass(frozen=True, kw_only=True)
class FreeDecay:
    """The moving samples of a record, cut once from the data and before any model: what estimators are given.

    Attributes
    ----------
    name : str
        Name of the record.
    values : ndarray, shape (n,)
        Samples of the moving part, as recorded (rest position not subtracted).
    start_time : float
        Time of ``values[0]`` in the record [s].
    step : float
        Sampling interval [s].
    quantity : Quantity
        What was measured.
    unit : str
        Its unit; not SI when the sensor was not calibrated.
    system : Oscillator
        The declared system.
    frequency : float
        Rough angular frequency found in the data [rad/s].
    phase : float
        Rough phase of ``values[0]`` in [0, 2 pi): zero is a turning point on the positive side
        of the *displacement*, whatever was measured.
    rest_position : float
        Rough rest position in the unit of the signal, or the one given.
    stops : bool
        Whether the motion came to rest within the record.
    rest_known : bool
        Whether ``rest_position`` was given, not found.
    disturbed : int
        Half cycles after the release that are left out as a hand still acted on them.
    """

    name: str
    values: Array
    start_time: float
    step: float
    quantity: Quantity
    unit: str
    system: Oscillator
    frequency: float
    phase: float
    rest_position: float
    stops: bool
    rest_known: bool = False
    disturbed: int = 0

    @property
    def time(self) -> Array:
        """Seconds since the first moving sample, shape (n,)."""
        return self.step * np.arange(self.values.size, dtype=np.float64)

    @property
    def release_notes(self) -> tuple[str, ...]:
        """What a reader must know of the release; empty where it was free."""
        if not self.disturbed:
            return ()
        return (
            f"{self.name}: the release was still disturbed, as by a hand: the first {self.disturbed} half "
            f"cycles are left out, up to the turning point at {self.start_time:.4g} s",
        )

    @property
    def located(self) -> Located:
        """Where the decay lies in ``values[None]``, all of which it is: a batch of one record."""
        return Located(
            status=np.array([FOUND], dtype=np.int64),
            start=np.zeros(1, dtype=np.int64),
            stop=np.array([self.values.size], dtype=np.int64),
            frequency=np.array([self.frequency * self.step]),
            phase=np.array([self.phase]),
            rest_position=np.array([self.rest_position]),
            stops=np.array([self.stops]),
            disturbed=np.array([self.disturbed], dtype=np.int64),
        )


def find_free_decay(
    record: xr.DataArray,
    system: Oscillator,
    *,
    start: float | None = None,
    rest_position: float | None = None,
    resolution: float | None = None,
) -> FreeDecay:
    """Find the moving part of a record, from the data alone.

    The declared natural frequency only says where to look; the data decide. The start is the release (a
    record may begin in mid-motion: then it is the first sample), or the first turning point after a hand has
    let go, see :mod:`friction_bayes.decay.disturbed_release`. The stop is the turning point nearest to
    where the amplitude meets zero, or to where a sensor with steps has begun to show no more than two
    neighbouring levels for half a period and longer, or the end of the record.

    Parameters
    ----------
    record : xarray.DataArray
        A record that :func:`~friction_bayes.records.record.validate_record` has passed.
    system : Oscillator
        The declared system.
    start : float, optional
        Time at which the free decay starts [s], when known; no hand is then looked for.
    rest_position : float, optional
        Rest position in the unit of the signal, when known.
    resolution : float, optional
        Step of the sensor, unit of the signal, where the samples are means of several and do not show it.

    Returns
    -------
    FreeDecay

    Raises
    ------
    InputError
        If the record holds NaN or infinities, is constant, shows no oscillation, or holds fewer than three
        half cycles.
    """
    name = record_name(record)
    quantity = record_quantity(record)
    if quantity.angular != system.angular:
        kind = "rotation" if system.angular else "linear motion"
        raise InputError(
            name,
            f"{quantity.name} does not belong to a {kind}",
            "declare --inertia for angles, --mass otherwise",
        )
    values = np.ascontiguousarray(record.values, dtype=float)
    clock = np.asarray(record["time"].values, dtype=float)
    step = sampling_interval(record)
    first = -1
    if start is not None:
        first = int(np.searchsorted(clock, finite("start", start) - 1e-9 * step))
        if not clock[0] - step <= start <= clock[-1]:
            raise InputError(
                "start", f"{start:g} s lies outside the record", f"give {clock[0]:g} .. {clock[-1]:g} s"
            )
    found = locate_free_decays(
        values[None], step, system.natural_frequency, quantity.order, first, resolution
    )
    if found.status[0] != FOUND:
        raise _refusal(name, int(found.status[0]), values, clock, step * system.natural_frequency)
    begin, end = int(found.start[0]), int(found.stop[0])
    return FreeDecay(
        name=name,
        values=values[begin:end],
        start_time=float(clock[begin]),
        step=step,
        quantity=quantity,
        unit=str(record.attrs.get("units", quantity.unit)),
        system=system,
        frequency=float(found.frequency[0]) / step,
        phase=float(found.phase[0]),
        rest_position=(
            float(found.rest_position[0]) if rest_position is None else finite("rest_position", rest_position)
        ),
        stops=bool(found.stops[0]),
        rest_known=rest_position is not None,
        disturbed=int(found.disturbed[0]),
    )


def locate_free_decays(
    values: Array,
    step: float,
    natural_frequency: float,
    order: int,
    start: int = -1,
    resolution: float | None = None,
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

    Returns
    -------
    Located
    """
    frequencies = _spectral_frequency(values[:, max(start, 0) :], step * natural_frequency)
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
    )
    locate_moving_parts(values, frequencies, resolutions, order, start, located)
    return located


def _tail_resolution(values: Array, tail: int) -> Array:
    """Step of the sensor, shape (records,): zero where none shows, or where the record does not end still.

    A record that does repeats values in its last ``tail`` samples; it is looked for in those alone, as it
    takes time.
    """
    result = np.zeros(values.shape[0])
    if 0 < tail < values.shape[1]:
        for row, end in enumerate(values[:, -tail:]):
            if np.unique(end).size <= tail // 2:
                result[row] = quantisation_step(values[row]) or 0.0
    return result


def _spectral_frequency(values: Array, expected: float) -> Array:
    """Angular frequency [rad/sample] of the spectral maximum near ``expected``, shape (records,).

    The spectrum is that of the derivative: a hold before release or an offset leaves only a step in it.
    """
    clean = np.where(np.isfinite(values), values, 0.0)
    width = max(int(2.0 * math.pi / (_BAND * expected * _SAMPLES_PER_PERIOD)), 1)
    n = clean.shape[1] // width
    if n < 4:
        return np.full(values.shape[0], expected)
    expected = expected * width
    clean = clean[:, : n * width].reshape(-1, n, width).mean(axis=2)
    clean = clean - clean.mean(axis=1, keepdims=True)
    length = 1 << max(2 * n - 1, 8).bit_length()
    grid = np.arange(length // 2 + 1) * (2.0 * math.pi / length)
    low, high = max(expected / _BAND, 2.0 * math.pi / n), min(_BAND * expected, math.pi)
    band = np.flatnonzero((grid >= low) & (grid <= high))
    if band.size < 3:
        return np.full(values.shape[0], expected / width)
    power = np.abs(np.fft.rfft(clean, length, axis=1)[:, band] * np.sin(0.5 * grid[band])) ** 2
    peak = np.clip(power.argmax(axis=1), 1, band.size - 2)
    rows = np.arange(values.shape[0])
    before, at, after = (power[rows, peak + k] for k in (-1, 0, 1))
    bend = before - 2.0 * at + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, 1.0), 0.0)
    return np.asarray((grid[band[peak]] + np.clip(shift, -1.0, 1.0) * grid[1]) / width)


def _refusal(name: str, status: int, values: Array, clock: Array, expected: float) -> InputError:
    """Return what to say of a record in which no free decay was found."""
    if status == NOT_FINITE:
        bad = np.flatnonzero(~np.isfinite(values))
        return InputError(
            name,
            f"{bad.size} samples are not finite, the first {values[bad[0]]} at {clock[bad[0]]:g} s",
            "cut them out or repair them",
        )
    if status == CONSTANT:
        return InputError(name, f"constant signal, {values[0]:g} throughout", "give a record of a free decay")
    if status == NO_OSCILLATION:
        return InputError(
            name,
            f"no free oscillation found within a factor {_BAND:g} of the declared sqrt(k/m)",
            "check the record, the stiffness and the mass or inertia",
        )
    assert status == TOO_SHORT
    cycles = expected * values.size / math.pi
    return InputError(
        name,
        f"fewer than three half cycles of free motion ({cycles:.1f} half periods of sqrt(k/m) on record)",
        "give a longer record",
    )
