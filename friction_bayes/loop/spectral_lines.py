"""Spectral lines of a residual, as a linear problem: a sine and a cosine at the line's frequency."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.loop.fit import LoopFit
from friction_bayes.loop.noise import whiten
from friction_bayes.loop.parameters import Coordinate

__all__ = ["SpectralLine", "strongest_lines"]

_LINES = 2
_LEAST_PERIODS = 2
"""Periods of a line within the record; with fewer it is a drift."""
_WIDTH = 8
"""Half width of a line [1/zero padding] that is taken out before the next one is looked for."""


@dataclass(frozen=True, eq=False)
class SpectralLine:
    """A line of one frequency in every record, each with its own sine and cosine.

    Attributes
    ----------
    frequency : float
        Of the line [Hz].
    duration : float
        Of the record it was found in [s].
    columns : list of ndarray, shape (n, 2 R)
        Sine and cosine of each of the ``R`` records.
    """

    frequency: float
    duration: float
    columns: list[Array]

    @property
    def size(self) -> int:
        """Number of columns."""
        return 2 * len(self.columns)

    def prior(self, coordinates: Sequence[Coordinate]) -> list[float]:
        """Prior precision of each column's coefficient: that of the amplitude."""
        amplitudes = coordinates[::3]
        return [1.0 / c.prior.scale**2 for c in amplitudes for _ in range(2)]

    def start(self, coordinates: Sequence[Coordinate], coefficients: Array) -> Array:
        """Coordinates of amplitude, frequency and phase from the coefficients."""
        values = []
        for sine, cosine in coefficients.reshape(-1, 2):
            values += [math.hypot(sine, cosine), self.frequency, math.atan2(cosine, sine)]
        return np.array([c.coordinate(v) for c, v in zip(coordinates, values, strict=True)])

    def log_volume(self, coordinates: Sequence[Coordinate], coefficients: Array, energy: float) -> float:
        """Prior of the line, and the volume of its frequency, beside those of the coefficients.

        Parameters
        ----------
        coordinates : sequence of Coordinate
            Amplitude, frequency and phase of each record.
        coefficients : ndarray, shape (2 R,)
        energy : float
            Sum of squares of the line over the noise variance.
        """
        value = 0.0
        # frequency is known to the slope of the phase over the record
        sd = math.sqrt(12.0 / max(energy, 1e-12)) / (2.0 * math.pi * self.duration)
        for i, (sine, cosine) in enumerate(coefficients.reshape(-1, 2)):
            amplitude, frequency, _ = coordinates[3 * i : 3 * i + 3]
            size = max(math.hypot(sine, cosine), 1e-6 * amplitude.prior.scale)
            # half-normal in the amplitude and flat in the phase, as a density over sine and cosine
            value -= math.log(math.sqrt(0.5 * math.pi) * amplitude.prior.scale * 2.0 * math.pi * size)
            share = math.sqrt(2.0 * math.pi) * sd / (frequency.prior.high - frequency.prior.low)
            value += min(math.log(share), 0.0)
        return value


def strongest_lines(fit: LoopFit) -> Iterator[SpectralLine]:
    """Find the strongest lines in the residual of the longest record."""
    r = int(np.argmax([segment.values.size for segment in fit.model.segments]))
    segment, noise = fit.model.segments[r], fit.noises[r]
    residual = noise.residual * (noise.weight > 0.0)
    residual = np.clip(residual, -4.0 * noise.sd, 4.0 * noise.sd)
    n = residual.size
    size = 1 << (4 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(residual * np.hanning(n), size))
    power[: _LEAST_PERIODS * size // n] = 0.0
    reach = _WIDTH * size // n
    for _ in range(_LINES):
        peak = int(np.argmax(power))
        frequency = peak / (size * segment.decay.step)
        columns = []
        for i, other in enumerate(fit.model.segments):
            angle = 2.0 * math.pi * frequency * other.time
            pair = np.zeros((other.values.size, 2 * len(fit.noises)))
            pair[:, 2 * i] = np.sin(angle)
            pair[:, 2 * i + 1] = np.cos(angle)
            columns.append(whiten(pair, fit.noise_models[i].ar))
        yield SpectralLine(frequency, segment.duration, columns)
        power[max(peak - reach, 0) : peak + reach] = 0.0
