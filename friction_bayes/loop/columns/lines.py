"""Lines in the spectrum of a law's residual: interference if they are steady, a second mode if they die out.

A line that dies out with a decay time ``T`` is most visible under the window ``exp(-t/T)``, its own envelope.
A few decay times are tried, each on as much of the record as such a line lasts.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.optimize import minimize, minimize_scalar

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE

__all__ = ["LOG_DECAY_TIME", "OF_LINES", "Line", "decaying_lines", "lines_in_residual", "steady_lines"]

OF_LINES = (PERIODIC_INTERFERENCE.name, SECOND_MODE.name)
"""Effects that are lines."""

LOG_DECAY_TIME = math.log(9.0)
"""Largest error of the logarithm of a decay time where a line is first found."""
_MOST_LINES = 8
"""Largest number of lines of each effect in one record: a second mode, its products, the mains."""
_NEIGHBOURS = 61
"""Ordinates of a spectrum in the surroundings that a line is compared with."""
_APART = 4.0
"""Distance between two lines times the length of the window: those of a windowed signal are four wide."""
_CLOSE = 1e-3
"""Ordinates to within which the frequency of a line is sought: a hundredth of a radian at the end."""
_PARTS = (1, 3, 9)
"""How many times as long as a window the record is; between two, a line keeps nine tenths of its power."""
_DECAYED = 5.0
"""Decay times within a window."""


class Line(NamedTuple):
    """A line of one frequency.

    Attributes
    ----------
    frequency : float
        [Hz].
    decay_time : float
        In which it falls to 1/e [s]; infinite for a steady one.
    scatter : float
        Standard deviation of the logarithm of the decay time.
    """

    frequency: float
    decay_time: float = math.inf
    scatter: float = 0.0

    @property
    def steady(self) -> bool:
        return math.isinf(self.decay_time)

    @property
    def effect(self) -> str:
        """Name of the effect that it is."""
        return PERIODIC_INTERFERENCE.name if self.steady else SECOND_MODE.name

    def __str__(self) -> str:
        text = f"{self.frequency:.4g} Hz"
        return text if self.steady else f"{text} that dies out in {self.decay_time:.3g} s"

    @property
    def half_width(self) -> float:
        """Distance from its frequency at which a line that dies out has half its power [Hz]."""
        return 1.0 / (2.0 * math.pi * self.decay_time)

    def waves(self, time: Array) -> dict[str, Array]:
        """Its sine and cosine of unit amplitude, time [s] since the record began."""
        angle, envelope = 2.0 * math.pi * self.frequency * time, np.exp(-time / self.decay_time)
        return {"sine": envelope * np.sin(angle), "cosine": envelope * np.cos(angle)}

    def moved(self, sine: Array, cosine: Array, frequency: Array, decay_time: Array) -> dict[str, Array]:
        """Sines and cosines, drawn of this line, of lines near it that look like it where it shows.

        That is half a decay time on, which is how long a line lasts on average over its power. How large it
        began, and with which phase, is known as its decay time and its frequency are.
        """
        shows = 0.5 * self.decay_time
        larger = shows * (1.0 / decay_time - 1.0 / self.decay_time)
        turned = 2.0 * math.pi * shows * (self.frequency - frequency)
        began = (sine + 1j * cosine) * np.exp(larger + 1j * turned)
        return {"sine": began.real, "cosine": began.imag}


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Height of each peak in the spectrum of a signal over its surroundings.

    Attributes
    ----------
    signal : ndarray, shape (n,)
        About its mean.
    window : ndarray, shape (m,)
        Over its beginning.
    step : float
        Sampling interval [s].
    decay_time : float
        Of the window [s].
    height : ndarray, shape (m // 2 + 1,)
        Power over the mean of the surroundings; zero where no top is.
    """

    signal: Array
    window: Array
    step: float
    decay_time: float
    height: Array

    @classmethod
    def of(cls, values: Array, window: Array, decay_time: float, segment: Segment) -> _Spectrum:
        signal = values - values.mean()
        power: Array = np.abs(np.fft.rfft(signal[: window.size] * window)) ** 2
        # the median of exponential ordinates is ln 2 of their mean; at an end they are reflected: of copies
        # of the last one most of its surroundings would be made
        around = median_filter(power, _NEIGHBOURS, mode="reflect") / math.log(2.0)
        # an ordinate lower than a neighbour is the flank of another line, or of the motion's own band
        top = power >= maximum_filter1d(power, 3)
        height = np.zeros_like(power)
        height[top] = power[top] / np.maximum(around[top], 1e-300)
        found = cls(signal, window, segment.decay.step, decay_time, height)
        height[_of_motion(found.frequency, decay_time, segment)] = 0.0
        return found

    @property
    def frequency(self) -> Array:
        return np.asarray(np.fft.rfftfreq(self.window.size, self.step))

    @property
    def stands_out(self) -> bool:
        """Whether its highest peak exceeds what noise is expected to have."""
        by_chance = self.window.size * math.exp(-float(self.height.max()))
        return by_chance < settings.SETTINGS.noise_alarm_rate

    def strike_out(self, line: Line) -> None:
        """Exclude the surroundings of a line from the search for others."""
        length = min(self.window.size * self.step, _DECAYED * line.decay_time)
        self.height[np.abs(self.frequency - line.frequency) * length < _APART] = 0.0

    def highest(self) -> tuple[Line, Line]:
        """The ordinate of the highest peak, and the line that it is part of."""
        ordinate = int(np.argmax(self.height))
        at = Line(float(self.frequency[ordinate]), self.decay_time)
        if at.steady:
            place = _top(self.signal * self.window, ordinate)
            return at, Line(place / (self.window.size * self.step))
        return at, _decaying_top(self.signal, self.step, at)


def lines_in_residual(
    innovations: Array, force: Array, segment: Segment, known: Sequence[Line], effects: Collection[str]
) -> tuple[Line, ...]:
    """Lines of these effects that exceed their surroundings in a spectrum, except the motion's.

    Parameters
    ----------
    innovations : ndarray, shape (n,)
        Under the law and the random force, in standard deviations.
    force : ndarray, shape (n,)
        The random force, which hides lines that the oscillator responds to.
    segment : Segment
    known : sequence of Line
        Those that have been found: another one of the same effect lies apart from them.
    effects : collection of str
        Those that may act.
    """
    found: tuple[Line, ...] = ()
    if PERIODIC_INTERFERENCE.name in effects:
        found += steady_lines((innovations, force), segment, [line for line in known if line.steady])
    if SECOND_MODE.name in effects:
        found += decaying_lines(innovations, segment, [line for line in known if not line.steady])
    return found


def steady_lines(signals: Sequence[Array], segment: Segment, known: Sequence[Line] = ()) -> tuple[Line, ...]:
    """Lines that last (see :func:`lines_in_residual`)."""
    window = np.hanning(signals[0].size)
    return _found([_Spectrum.of(signal, window, math.inf, segment) for signal in signals], segment, known)


def decaying_lines(innovations: Array, segment: Segment, known: Sequence[Line] = ()) -> tuple[Line, ...]:
    """Lines that die out within the record (see :func:`lines_in_residual`).

    Not in the random force: its spectrum falls so steeply that windows which begin at once make tops in it.
    """
    spectra = []
    for part in _PARTS:
        samples = innovations.size // part
        window = np.exp(-_DECAYED / samples * np.arange(samples))
        decay_time = samples * segment.decay.step / _DECAYED
        spectra.append(_Spectrum.of(innovations, window, decay_time, segment))
    return _found(spectra, segment, known)


def _found(spectra: Sequence[_Spectrum], segment: Segment, known: Sequence[Line]) -> tuple[Line, ...]:
    for spectrum in spectra:
        for line in known:
            spectrum.strike_out(line)
    found: list[Line] = []
    while len(known) + len(found) < _MOST_LINES:
        standing = [spectrum for spectrum in spectra if spectrum.stands_out]
        if not standing:
            break
        at, line = max(standing, key=lambda spectrum: float(spectrum.height.max())).highest()
        for spectrum in spectra:
            spectrum.strike_out(at)
            spectrum.strike_out(line)
        dies_out = line.decay_time < segment.duration
        # its ordinate may lie just outside of the motion's band
        if (line.steady or dies_out) and not _of_motion(line.frequency, line.decay_time, segment):
            found.append(line)
    return tuple(found)


def _of_motion(frequency: ArrayLike, decay_time: float, segment: Segment) -> Mask:
    """Whether lines [Hz] may be due to changes of the motion about a harmonic, or to drifts."""
    line, motion = np.asarray(frequency, dtype=np.float64), segment.decay.frequency / (2.0 * math.pi)
    # a line that dies out is so wide at half its power
    width = 1.0 / (math.pi * decay_time)
    # apart from its own negative frequency
    least = max(0.5 * _APART / segment.duration, 1.0 / decay_time)
    band = max(settings.SETTINGS.harmonic_band * motion, width)
    off = np.abs(line - np.rint(line / motion) * motion) >= band
    return np.asarray(~off | (line < least))


def _top(signal: Array, ordinate: int) -> float:
    """Position of a spectrum's maximum within half an ordinate of its highest one, in ordinates.

    A line held at the ordinate may slip by a quarter of a turn over either half of the record. It would leave
    up to a third of its power to the other effects, more or less with every sample that the record has.
    """
    angle = 2.0 * math.pi / signal.size * np.arange(signal.size)

    def minus_power(place: float) -> float:
        return -float(np.abs(signal @ np.exp(-1j * place * angle)) ** 2)

    bounds = (ordinate - 0.5, ordinate + 0.5)
    found = minimize_scalar(minus_power, bounds=bounds, method="bounded", options={"xatol": _CLOSE})
    return float(found.x)


def _decaying_top(innovations: Array, step: float, near: Line) -> Line:
    """Frequency and decay time with the most power of a line near an ordinate under its own envelope."""
    time = step * np.arange(innovations.size)

    def at(place: Array) -> tuple[float, float]:
        ordinates, log_ratio = place
        frequency = near.frequency + ordinates / (_DECAYED * near.decay_time)
        return float(frequency), near.decay_time * math.exp(log_ratio)

    def minus_power(place: Array) -> float:
        frequency, decay_time = at(place)
        envelope = np.exp(-time / decay_time)
        wave = np.exp(-2j * math.pi * frequency * time)
        return -float(np.abs((innovations * envelope) @ wave) ** 2 / (envelope @ envelope))

    found = minimize(
        minus_power,
        np.zeros(2),
        method="Nelder-Mead",
        # a spectrum that rises towards the motion would lead further away
        bounds=[(-0.5, 0.5), (-LOG_DECAY_TIME, LOG_DECAY_TIME)],
        options={
            "initial_simplex": [[0.0, 0.0], [0.3, 0.0], [0.0, 0.5]],
            "xatol": _CLOSE,
            "fatol": 1e-6 * abs(minus_power(np.zeros(2))),
        },
    )
    # the power is half of the line's sum of squares over the noise's variance
    return Line(*at(found.x), scatter=math.sqrt(2.0 / -found.fun))
