"""Lines in the spectrum of a law's residual: interference if they are steady, a second mode if they die out.

A line that dies out with a decay time ``T`` is most visible under the window ``exp(-t/T)``, its own envelope.
A few decay times are tried, each on as much of the record as such a line lasts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d, percentile_filter
from scipy.optimize import minimize, minimize_scalar

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE
from friction_bayes.mechanics.effects.second_mode import SECOND_MODE

__all__ = [
    "LINES_APART",
    "LOG_DECAY_TIME",
    "Line",
    "LineSearch",
    "decaying_lines",
    "steady_lines",
]

_ALARM_RATE = 1e-4
"""Probability that noise passes for a line by chance: each changes the model of the whole record."""
_HARMONIC_BAND = 0.05
"""Distance from a harmonic of the motion, over its frequency, within which changes of it make lines."""
LOG_DECAY_TIME = math.log(9.0)
"""Largest error of the logarithm of a decay time where a line is first found."""
_MOST_LINES = 8
"""Largest number of lines of each effect in one record: a second mode, its products, the mains."""
_NEIGHBOURS = 61
"""Ordinates of a spectrum in the surroundings that a line is compared with."""
_QUANTILES = (0.5, 0.9)
"""Of these, from each of which their mean is computed."""
LINES_APART = 4.0
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
        """Name of the effect that it is: interference if it is steady, a second mode if it dies out."""
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


class LineSearch(NamedTuple):
    """Where lines are looked for.

    Attributes
    ----------
    step : float
        Sampling interval [s].
    duration : float
        Of the record [s].
    motion : float
        Frequency of the motion [Hz].
    lowest : float
        Frequency below which no line is looked for [Hz].
    """

    step: float
    duration: float
    motion: float
    lowest: float = 0.0

    def of_motion(self, frequency: ArrayLike, decay_time: float) -> Mask:
        """Whether lines [Hz] may be due to changes of the motion about a harmonic, or to drifts."""
        line = np.asarray(frequency, dtype=np.float64)
        # a line that dies out is so wide at half its power
        width = 1.0 / (math.pi * decay_time)
        # apart from its own negative frequency
        least = max(0.5 * LINES_APART / self.duration, 1.0 / decay_time, self.lowest)
        band = max(_HARMONIC_BAND * self.motion, width)
        off = np.abs(line - np.rint(line / self.motion) * self.motion) >= band
        return np.asarray(~off | (line < least))

    def shows(self, line: Line, time: Array, signal: Array) -> bool:
        """Whether a line is higher than white noise of the whole signal would make one.

        ``time`` is [s], shape (n,) as the signal.
        """
        wave = np.exp(-2j * math.pi * line.frequency * time)
        height = float(np.abs(signal @ wave) ** 2) / float(signal @ signal)
        return self.no_chance(height, signal.size)

    def no_chance(self, height: float, samples: int) -> bool:
        """Whether noise is not expected to have an ordinate so high over their mean."""
        return samples * math.exp(-height) < _ALARM_RATE


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Height of each peak in the spectrum of a signal over its surroundings.

    Attributes
    ----------
    signal : ndarray, shape (n,)
        About its mean.
    window : ndarray, shape (m,)
        Over its beginning.
    search : LineSearch
    decay_time : float
        Of the window [s].
    height : ndarray, shape (m // 2 + 1,)
        Power over the mean of the surroundings; zero where no top is.
    """

    signal: Array
    window: Array
    search: LineSearch
    decay_time: float
    height: Array

    @classmethod
    def of(cls, values: Array, window: Array, decay_time: float, search: LineSearch) -> _Spectrum:
        signal = values - values.mean()
        power: Array = np.abs(np.fft.rfft(signal[: window.size] * window)) ** 2
        # noise has exponential ordinates. Where some are much higher, as at harmonics of what a law lacks,
        # what is higher still is no line; but one that dies out has high flanks of its own
        levels = _QUANTILES if math.isinf(decay_time) else _QUANTILES[:1]
        # at an end they are reflected: of copies of the last one most of its surroundings would be made
        around = [percentile_filter(power, 100.0 * p, _NEIGHBOURS, mode="reflect") for p in levels]
        mean = np.max([each / -math.log1p(-p) for each, p in zip(around, levels, strict=True)], axis=0)
        # an ordinate lower than a neighbour is the flank of another line, or of the motion's own band
        top = power >= maximum_filter1d(power, 3)
        height = np.zeros_like(power)
        height[top] = power[top] / np.maximum(mean[top], 1e-300)
        found = cls(signal, window, search, decay_time, height)
        height[search.of_motion(found.frequency, decay_time)] = 0.0
        return found

    @property
    def frequency(self) -> Array:
        return np.asarray(np.fft.rfftfreq(self.window.size, self.search.step))

    @property
    def stands_out(self) -> bool:
        """Whether its highest peak exceeds what noise is expected to have."""
        return self.search.no_chance(float(self.height.max()), self.window.size)

    def strike_out(self, line: Line) -> None:
        """Exclude the surroundings of a line from the search for others."""
        length = min(self.window.size * self.search.step, _DECAYED * line.decay_time)
        self.height[np.abs(self.frequency - line.frequency) * length < LINES_APART] = 0.0

    def highest(self) -> tuple[Line, Line]:
        """The ordinate of the highest peak, and the line that it is part of."""
        ordinate = int(np.argmax(self.height))
        at = Line(float(self.frequency[ordinate]), self.decay_time)
        if at.steady:
            place = _top(self.signal * self.window, ordinate)
            return at, Line(place / (self.window.size * self.search.step))
        return at, _decaying_top(self.signal, self.search.step, at)


def steady_lines(
    signals: Sequence[Array], search: LineSearch, known: Sequence[Line] = ()
) -> tuple[Line, ...]:
    """Lines that last and exceed their surroundings in a spectrum of one of several signals.

    Parameters
    ----------
    signals : sequence of ndarray, shape (n,)
    search : LineSearch
    known : sequence of Line
        Those that have been found: another one lies apart from them.
    """
    window = np.hanning(signals[0].size)
    return _found([_Spectrum.of(signal, window, math.inf, search) for signal in signals], search, known)


def decaying_lines(signal: Array, search: LineSearch, known: Sequence[Line] = ()) -> tuple[Line, ...]:
    """Lines that die out within a signal (see :func:`steady_lines`)."""
    spectra = []
    for samples in (signal.size // part for part in _PARTS):
        if samples < 2.0 * LINES_APART:
            break
        window = np.exp(-_DECAYED / samples * np.arange(samples))
        spectra.append(_Spectrum.of(signal, window, samples * search.step / _DECAYED, search))
    return _found(spectra, search, known)


def _found(spectra: Sequence[_Spectrum], search: LineSearch, known: Sequence[Line]) -> tuple[Line, ...]:
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
        dies_out = line.decay_time < search.duration
        # its ordinate may lie just outside of the motion's band
        if (line.steady or dies_out) and not search.of_motion(line.frequency, line.decay_time):
            found.append(line)
    return tuple(found)


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
