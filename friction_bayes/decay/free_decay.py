"""The moving part of a record: where the free decay starts and stops, its rest position and rough phase."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.checks import finite
from friction_bayes.core.declared_force import frequencies_disagree
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import UNCALIBRATED_UNITS, Quantity
from friction_bayes.core.system import Oscillator
from friction_bayes.core.text import listed
from friction_bayes.decay.even_grid import even_grid
from friction_bayes.decay.leaps import around_release, find_leap
from friction_bayes.decay.located import (
    CONSTANT,
    FOUND,
    LEAST_HALF_CYCLES,
    NO_OSCILLATION,
    NOT_DECAYING,
    NOT_FINITE,
    SEVERAL_DECAYS,
    SEVERAL_MODES,
    TOO_SHORT,
    Located,
)
from friction_bayes.decay.location import decays_within, locate_free_decays
from friction_bayes.decay.sensor_calibration import force_factor, friction_unit
from friction_bayes.decay.spectral_modes import BAND, SpectralModes, spectral_modes
from friction_bayes.records.clock import check_gaps, is_even
from friction_bayes.records.record import record_name, record_quantity

__all__ = ["FreeDecay", "after_leap", "check_sampling", "find_free_decay", "no_decay_fits"]

_LEAST_PER_PERIOD = 2.0
"""Samples a period of the declared frequency, which must be more: Nyquist's."""
_RELEASE_KNOWN_TO = 1.0 / 16.0
"""Of a period, as it is looked for in strides of half as much."""
_BEYOND_TURN = math.pi / 8.0
"""Phase from a turning point, to which its time is known better than this."""
_FAR = 0.1
"""Relative distance from the declared frequency that no damping explains under which a record oscillates."""
_SAME_FREQUENCY = 0.03
"""Relative distance from a multiple of the declared frequency: a large swing or light damping shifts it."""
_MULTIPLES = {
    2.0: "a signal without a sign (distance from the middle, magnitude) swings twice as fast",
    0.5: "a stiffness from half periods that were taken for whole ones implies twice the frequency",
}
"""Ratios that a mistake makes, and which."""


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
        Sampling interval [s], the mean one where they differ.
    stamps : ndarray, shape (n,), or None
        Seconds since the first of them; None where they are evenly spaced.
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
    rests_early : bool
        Whether a part after is left out in which the mass rests where sliding friction would not hold it.
    driven : bool
        Whether a part before is left out in which no amplitude was lost, as under a drive.
    later, earlier : int
        Half cycles that are left out in addition, at the start and at the end: something else held the mass.
    drift : float
        Range of a drift of the sensor's zero that has been taken out of ``values``, unit of the signal.
    lines : tuple of float
        Frequencies of interference and other modes that have been taken out of ``values`` [Hz].
    stray : tuple of float
        Times in the record of samples far outside the noise that are left out of ``values`` [s].
    other_frequency, other_share : float
        Angular frequency of the next strongest oscillation in the spectrum [rad/s] and its amplitude over
        that of the one followed; nan where there is none.
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
    stamps: Array | None = None
    rest_known: bool = False
    disturbed: int = 0
    driven: bool = False
    rests_early: bool = False
    later: int = 0
    earlier: int = 0
    drift: float = 0.0
    lines: tuple[float, ...] = ()
    stray: tuple[float, ...] = ()
    other_frequency: float = math.nan
    other_share: float = math.nan

    @property
    def time(self) -> Array:
        """Seconds since the first moving sample, shape (n,)."""
        if self.stamps is not None:
            return self.stamps
        return self.step * np.arange(self.values.size, dtype=np.float64)

    @property
    def duration(self) -> float:
        """From the first to the last moving sample [s]."""
        return self.step * (self.values.size - 1)

    @property
    def half_cycles(self) -> int:
        """Whole half cycles of it."""
        return int(self.duration * self.frequency / math.pi)

    def without_drift(self, drift: Array) -> FreeDecay:
        """The same less a drift of the sensor's zero, at each sample, shape (n,)."""
        return replace(self, values=self.values - drift, drift=float(np.ptp(drift)))

    def without_lines(self, waves: Array, frequencies: Sequence[float]) -> FreeDecay:
        """The same less their waves at each sample, shape (n,)."""
        return replace(self, values=self.values - waves, lines=tuple(frequencies))

    def without_stray(self, stray: Mask) -> FreeDecay:
        """The same without some samples, shape (n,)."""
        left_out = (self.start_time + self.time[stray]).tolist()
        kept = np.flatnonzero(~stray)
        decay = self._between(kept[0], kept[-1] + 1)
        kept -= kept[0]
        if kept.size < decay.values.size:
            step = decay.duration / (kept.size - 1)
            decay = replace(decay, values=decay.values[kept], stamps=decay.time[kept], step=step)
        return replace(decay, stray=(*self.stray, *left_out))

    def without_samples_at(self, times: Array) -> FreeDecay:
        """The same without the samples at some times in the record [s], ascending, shape (k,)."""
        stray = np.zeros(self.values.size, np.bool_)
        after = times - self.start_time
        inside = after[(after >= 0.0) & (after <= self.time[-1])]
        stray[np.rint(np.interp(inside, self.time, np.arange(stray.size))).astype(int)] = True
        return self.without_stray(stray)

    def half_a_cycle_later(self) -> FreeDecay:
        """The same from a sixteenth of a cycle after the next turning point on."""
        to_turn = (-self.phase) % math.pi or math.pi
        first = int(np.searchsorted(self.time, (to_turn + _BEYOND_TURN) / self.frequency))
        later = self._between(first, self.values.size)
        stray = tuple(time for time in self.stray if time >= later.start_time)
        return replace(later, later=self.later + 1, stray=stray)

    def half_cycles_earlier(self, count: int) -> FreeDecay:
        """The same to a sixteenth of a cycle before one of the last turning points, the last the first."""
        phase = self.phase + self.frequency * self.time[-1]
        end = self.time[-1] - (phase % math.pi + (count - 1) * math.pi + _BEYOND_TURN) / self.frequency
        stop = int(np.searchsorted(self.time, end))
        return replace(self._before(stop), earlier=count, stops=False, rests_early=False)

    def until(self, stop: int) -> FreeDecay:
        """The same of the samples before one, at which the mass has come to rest."""
        return replace(self._before(stop), rests_early=True)

    def _before(self, stop: int) -> FreeDecay:
        shorter = self._between(0, stop)
        stray = tuple(time for time in self.stray if time <= shorter.start_time + shorter.duration)
        return replace(shorter, stray=stray)

    def _between(self, first: int, stop: int) -> FreeDecay:
        """The samples from one to before another."""
        if (first, stop) == (0, self.values.size):
            return self
        start, stamps, step = float(self.time[first]), self.stamps, self.step
        if stamps is not None:
            stamps = stamps[first:stop] - start
            step = float(stamps[-1]) / (stop - first - 1)
        return replace(
            self,
            values=self.values[first:stop],
            start_time=self.start_time + start,
            step=step,
            stamps=stamps,
            phase=(self.phase + self.frequency * start) % (2.0 * math.pi),
        )

    @property
    def places(self) -> Array:
        """Where the samples lie between the ends of the moving part, at -1 and 1, shape (n,)."""
        return 2.0 * self.time / self.duration - 1.0

    @property
    def calibrated(self) -> bool:
        """Whether its unit is one of what was measured."""
        return self.unit not in UNCALIBRATED_UNITS

    @property
    def force_factor(self) -> float:
        """Factor from the signal's friction coefficient to friction."""
        return force_factor(self.system, self.quantity, self.unit)

    @property
    def friction_unit(self) -> str:
        """Unit of friction."""
        return friction_unit(self.system, self.unit)

    @property
    def evenly_spaced(self) -> bool:
        """Whether the samples lie on an even grid, as nearly as matters."""
        return self.stamps is None

    def evenly(self, signal: Array, time: Array) -> Array:
        """What is left of the signal at times [s], interpolated to even ones, shape (n,) all.

        Itself where the samples are even. For spectra, in which uneven samples blur a line.
        """
        if self.evenly_spaced:
            return signal
        return np.interp(time[0] + self.step * np.arange(signal.size), time, signal)

    def on_even_grid(self) -> FreeDecay:
        """The same on an even grid, by a cubic spline, for what goes from sample to sample."""
        if self.stamps is None:
            return self
        grid, values = even_grid(self.stamps, self.values, self.frequency)
        return replace(self, values=values, step=float(grid[1]), stamps=None)

    @property
    def _slower(self) -> float:
        """Share by which a pendulum of known angles swings slower than the declared frequency, at most."""
        known = self.system.pendulum and self.quantity.order == 0 and self.unit == self.quantity.unit
        return float(np.max(np.abs(self.values))) ** 2 / 16.0 if known else 0.0

    @property
    def cut_notes(self) -> tuple[str, ...]:
        """What is left out in which something else held the mass."""
        notes = []
        if self.later:
            notes.append(
                f"{self.name}: what lies before {self.start_time:.4g} s is left out: it does not fit the "
                "rest, as under a hand or while a sensor settles"
            )
        if self.earlier:
            notes.append(
                f"{self.name}: what lies after {self.start_time + self.duration:.4g} s is left out: it does "
                "not fit what comes before, as where a hand stops the mass"
            )
        return tuple(notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the record; empty where it shows one oscillation, released freely."""
        notes = list(self.cut_notes)
        if self.disturbed:
            notes.append(
                f"{self.name}: the release was still disturbed, as by a hand or another mode that dies out: "
                f"the first {self.disturbed} half cycles are left out, up to the turning point at "
                f"{self.start_time:.4g} s"
            )
        if self.driven:
            notes.append(
                f"{self.name}: no amplitude was lost up to {self.start_time:.4g} s, as under a drive: that "
                "part is left out"
            )
        if self.rests_early:
            notes.append(
                f"{self.name}: the mass rests from {self.start_time + self.duration:.4g} s on, where sliding "
                "friction would not hold it: what follows is left out"
            )
        if self.drift:
            notes.append(
                f"{self.name}: the sensor's zero drifts by {self.drift:.3g} {self.unit} meanwhile, which "
                "is taken out"
            )
        if self.lines:
            found = listed(list(dict.fromkeys(f"{line:.3g}" for line in sorted(self.lines))))
            notes.append(
                f"{self.name}: interference, as of the mains, or another mode at {found} Hz is taken out"
            )
        if self.stray:
            one = len(self.stray) == 1
            notes.append(
                f"{self.name}: {len(self.stray)} {'sample lies' if one else 'samples lie'} far outside the "
                f"noise, the first at {min(self.stray):.6g} s, and {'is' if one else 'are'} left out"
            )
        if self.other_share > 0.0:
            notes.append(
                f"{self.name}: another oscillation at {self.other_frequency:.4g} rad/s, "
                f"{100.0 * self.other_share:.0f} % as strong in the spectrum as the one followed at "
                f"{self.frequency:.4g} rad/s"
            )
        return tuple(notes)

    def both_frequencies(self, frequency: float) -> str:
        """Say a frequency found [rad/s] next to the declared one, both in Hz."""
        found, declared = (each / (2.0 * math.pi) for each in (frequency, self.system.natural_frequency))
        return (
            f"swings at {found:.5g} Hz, declared {self.system.moving_name} and stiffness imply "
            f"{declared:.5g} Hz"
        )

    def far_from_declared(self, frequency: float) -> str:
        """Say what to check where a frequency found [rad/s] is much too far from the declared one.

        Empty where damping, a pendulum's large swing, or the standard deviations of the declared values may
        explain the distance.
        """
        ratio = frequency / self.system.natural_frequency
        near = -_FAR - self._slower < ratio - 1.0 < _FAR
        if near or not frequencies_disagree(self.system, frequency, math.nan):
            return ""
        units = "kg m2, N m/rad" if self.system.angular else "kg, N/m"
        check = f"check {self.system.moving_name}, stiffness and their units ({units})"
        for multiple, cause in _MULTIPLES.items():
            if -_SAME_FREQUENCY - self._slower < ratio / multiple - 1.0 < _SAME_FREQUENCY:
                return f"{cause}, and friction is then wrong; otherwise {check}"
        return f"no damping shifts it as far, {check}"

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
            driven=np.array([self.driven]),
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
    neighbouring levels for half a period and longer, or the end of the record. In a record of uneven times
    all this is sought on an even grid; the samples handed over are those of the record, at their own times.

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
        If the record holds NaN or infinities, is constant, shows no oscillation, or several, or one that does
        not decay, holds several decays or fewer than three half cycles, leaps, has a gap, or is sampled too
        slowly for the declared frequency.
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
    recorded = np.ascontiguousarray(record.values, dtype=float)
    stamps = np.asarray(record["time"].values, dtype=float)
    even = is_even(stamps)
    check_gaps(record, system.natural_frequency)
    clock, values = (stamps, recorded) if even else even_grid(stamps, recorded, system.natural_frequency)
    step = float((clock[-1] - clock[0]) / (clock.size - 1))
    check_sampling(name, step, system)
    first = -1
    if start is not None:
        first = int(np.searchsorted(clock, finite("start", start) - 1e-9 * step))
        if not clock[0] - step <= start <= clock[-1]:
            raise InputError(
                "start", f"{start:g} s lies outside {name}", f"give {clock[0]:g} .. {clock[-1]:g} s"
            )
    found = locate_free_decays(
        values[None], step, system.natural_frequency, quantity.order, first, resolution
    )
    modes = spectral_modes(values[None, max(first, 0) :], step * system.natural_frequency)
    if found.status[0] == SEVERAL_DECAYS:
        after = slice(max(first, 0), None)
        raise _several(name, values[after], clock[after], system, quantity, resolution)
    if found.status[0] != FOUND:
        raise _refusal(name, int(found.status[0]), values, clock, system, modes)
    begin, end = int(found.start[0]), int(found.stop[0])
    frequency, phase = float(found.frequency[0]) / step, float(found.phase[0])
    if quantity.order == 0:
        released = begin if first >= 0 else after_leap(values[:end], begin, frequency * step)
        phase = (phase + frequency * step * (released - begin)) % (2.0 * math.pi)
        begin = released
        leap = find_leap(values[begin:end], None if even else _near_stamps(clock[begin:end], stamps))
        if leap is not None:
            unit = record.attrs.get("units", quantity.unit)
            raise InputError(
                name,
                f"the {quantity.name} leaps by {leap[1]:.3g} {unit} at {clock[begin + leap[0]]:.4g} s, from "
                "one sample to the next",
                "where two recordings follow each other take one by --start and --end; where only some "
                "samples are wrong remove those rows, the times need not be even; unwrap an angle that "
                "starts over, and cut where the sensor slipped",
            )
    times = None
    if not even:
        released = clock[begin]
        begin, end = np.searchsorted(stamps, (released, clock[end - 1] + 0.5 * step)).tolist()
        times = stamps[begin:end] - stamps[begin]
        phase = (phase + frequency * float(stamps[begin] - released)) % (2.0 * math.pi)
    return FreeDecay(
        name=name,
        values=recorded[begin:end],
        start_time=float(stamps[begin]),
        step=step if times is None else float(times[-1] / (times.size - 1)),
        stamps=times,
        quantity=quantity,
        unit=str(record.attrs.get("units", quantity.unit)),
        system=system,
        frequency=frequency,
        phase=phase,
        rest_position=(
            float(found.rest_position[0]) if rest_position is None else finite("rest_position", rest_position)
        ),
        stops=bool(found.stops[0]),
        rest_known=rest_position is not None,
        disturbed=int(found.disturbed[0]),
        driven=bool(found.driven[0]),
        other_frequency=float(modes.other[0]) / step,
        other_share=float(modes.share[0]),
    )


def _near_stamps(clock: Array, stamps: Array) -> Mask:
    """Which times of an even grid, shape (n,), are no farther from a stamp than from their neighbours."""
    step, after = float(clock[1] - clock[0]), np.clip(np.searchsorted(stamps, clock), 1, stamps.size - 1)
    return np.minimum(np.abs(clock - stamps[after - 1]), np.abs(stamps[after] - clock)) <= step


def after_leap(values: Array, begin: int, omega: float) -> int:
    """First sample of a decay that begins with a leap, as where a recording was pasted to another.

    From a hold a release is flat, so that a few samples earlier or later are the same; this one is not.
    ``omega`` is the frequency in rad/sample.
    """
    before, after = around_release(begin, omega)
    leap = find_leap(values[before:after])
    if leap is None or abs(before + leap[0] + 1 - begin) > _RELEASE_KNOWN_TO * 2.0 * math.pi / omega:
        return begin
    return before + leap[0] + 1


def check_sampling(place: str, step: float, system: Oscillator) -> None:
    """Refuse an interval of samples [s] at which the declared frequency looks like another.

    Raises
    ------
    InputError
        Saying how many samples a period there are.
    """
    samples = 2.0 * math.pi / (system.natural_frequency * step)
    if samples <= _LEAST_PER_PERIOD:
        raise InputError(
            place,
            f"{samples:.3g} samples a period of the declared {system.natural_frequency:.4g} rad/s: it lies "
            "above Nyquist's frequency",
            f"sample faster than {system.natural_frequency / math.pi:.3g} Hz, or check mass, stiffness and "
            "the unit of time",
        )


def no_decay_fits(name: str, system: Oscillator) -> InputError:
    """Return what to say of a record that oscillates, and in a way that no free decay does."""
    return InputError(
        name,
        "no free decay under dry friction fits",
        "take one free decay by --start and --end where the record holds more, or check "
        f"{system.moving_name} and stiffness",
    )


def _several(
    name: str,
    values: Array,
    clock: Array,
    system: Oscillator,
    quantity: Quantity,
    resolution: float | None,
) -> InputError:
    """Return what to say of a recording of several decays."""
    step = (clock[-1] - clock[0]) / (clock.size - 1)
    decays = decays_within(values, step, system.natural_frequency, quantity.order, resolution)
    listed = ", ".join(
        f"{k}: {clock[each.start]:.4g} to {clock[each.stop - 1]:.4g} s ({each.half_cycles} half cycles)"
        for k, each in enumerate(decays, start=1)
    )
    return InputError(
        name,
        f"holds {len(decays)} free decays, {listed}",
        "choose one by --decay N, each by --decay all, or part of the record by --start and --end",
    )


def _refusal(
    name: str, status: int, values: Array, clock: Array, system: Oscillator, modes: SpectralModes
) -> InputError:
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
            f"no free oscillation found within a factor {BAND:g} of {_declared(system)}",
            f"check the record, {system.moving_name} and stiffness; where it was released more than once, "
            "take one decay by --start and --end",
        )
    if status == NOT_DECAYING:
        return InputError(
            name,
            "no loss of amplitude shows: the motion is steady or grows, as if driven, or noise hides it",
            "give the free decay alone, after the drive is off (--start)",
        )
    if status == SEVERAL_MODES:
        step = (clock[-1] - clock[0]) / (clock.size - 1)
        return InputError(
            name,
            f"oscillations at {modes.frequency[0] / step:.4g} and {modes.other[0] / step:.4g} rad/s, the "
            f"second {100.0 * modes.share[0]:.0f} % as strong, where one at "
            f"{system.natural_frequency:.4g} rad/s is declared",
            "excite or record one mode alone, with its sign, and declare its mass and stiffness",
        )
    assert status == TOO_SHORT
    cycles = system.natural_frequency * (clock[-1] - clock[0]) / math.pi
    return InputError(
        name,
        f"fewer than three half cycles of free motion are found in a record of {cycles:.1f} half periods, "
        "pi sqrt(m/k)",
        ("give a longer record" if cycles < LEAST_HALF_CYCLES + 1.0 else "release it from farther away")
        + f", or check {system.moving_name} and stiffness, for {_declared(system)}",
    )


def _declared(system: Oscillator) -> str:
    """The declared frequency, with the units that give it."""
    units = "kg m2, N m/rad" if system.angular else "kg, N/m"
    return f"the declared {system.natural_frequency / (2.0 * math.pi):.3g} Hz (SI units: {units})"
