"""Spectral lines of a residual, as a linear problem: a sine and a cosine at the line's frequency."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop import settings
from friction_bayes.loop.data.parameters import Coordinate
from friction_bayes.loop.data.prepared_record import Segment
from friction_bayes.loop.noise.likelihood import whiten
from friction_bayes.loop.search.fit import LoopFit
from friction_bayes.mechanics.effects.periodic_interference import PERIODIC_INTERFERENCE

__all__ = [
    "SpectralLine",
    "follows_motion",
    "has_line_of_motion",
    "strongest_lines",
]

_LINES = 2
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
        Sine and cosine of each of the ``R`` records, whitened.
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
        return [1.0 / own["amplitude"].prior.scale ** 2 for own in _by_record(coordinates) for _ in range(2)]

    def start(self, coordinates: Sequence[Coordinate], coefficients: Array) -> Array:
        """Coordinates of amplitude, frequency and phase from the coefficients."""
        at = []
        pairs = zip(_by_record(coordinates), coefficients.reshape(-1, 2), strict=True)
        for own, (sine, cosine) in pairs:
            values = {
                "amplitude": math.hypot(sine, cosine),
                "frequency": self.frequency,
                "phase": math.atan2(cosine, sine),
            }
            at += [c.coordinate(values[name]) for name, c in own.items()]
        return np.array(at)

    def log_volume(self, coordinates: Sequence[Coordinate], coefficients: Array, energy: float) -> float:
        r"""Prior density of a line as one of its sine and cosine, and the posterior volume of its frequency.

        With the prior scale :math:`s` of the amplitude and its value :math:`A`, the half-normal prior of the
        amplitude and the flat prior of the phase are the density :math:`h(A) / (2 \pi A)` over sine and
        cosine, :math:`h` that of the half-normal, of which :math:`\exp(-A^2/2s^2)` is counted with the
        coefficients already. The frequency is known to the slope of the phase over the record,
        :math:`\sigma_f = \sqrt{12 / E} / (2 \pi T)`, and takes the share
        :math:`\sqrt{2 \pi} \sigma_f` of its flat prior.

        Parameters
        ----------
        coordinates : sequence of Coordinate
            Amplitude, frequency and phase of each record.
        coefficients : ndarray, shape (2 R,)
        energy : float
            Sum of squares of the line over the noise variance, :math:`E`.
        """
        value = 0.0
        sd = math.sqrt(12.0 / max(energy, 1e-12)) / (2.0 * math.pi * self.duration)
        pairs = zip(_by_record(coordinates), coefficients.reshape(-1, 2), strict=True)
        for own, (sine, cosine) in pairs:
            scale, frequency = own["amplitude"].prior.scale, own["frequency"].prior
            size = max(math.hypot(sine, cosine), 1e-6 * scale)
            value -= math.log(math.sqrt(0.5 * math.pi) * scale * 2.0 * math.pi * size)
            share = math.sqrt(2.0 * math.pi) * sd / (frequency.high - frequency.low)
            value += min(math.log(share), 0.0)
        return value


def _by_record(coordinates: Sequence[Coordinate]) -> list[dict[str, Coordinate]]:
    """Coordinates of each record by name."""
    records: dict[int, dict[str, Coordinate]] = {}
    for c in coordinates:
        records.setdefault(c.record, {})[c.name] = c
    return list(records.values())


def follows_motion(frequency: ArrayLike, segment: Segment) -> Mask:
    """Whether lines [Hz] lie within half a line width of the motion's frequency or its first harmonics.

    A line of a record of length ``T`` is ``2 / T`` wide between the zeros beside it. There a line from
    outside cannot be told from what a wrong force law leaves.
    """
    motion = segment.decay.frequency / (2.0 * math.pi)
    line = np.asarray(frequency, dtype=np.float64)
    harmonic = np.clip(np.rint(line / motion), 1, settings.SETTINGS.quiet_harmonic)
    return np.asarray(np.abs(line - harmonic * motion) * segment.duration < 1.0)


def has_line_of_motion(fit: LoopFit) -> bool:
    """Whether the interference of a fit is a line of the motion."""
    model = fit.model
    return PERIODIC_INTERFERENCE.name in model.effects and any(
        follows_motion(model.value(fit.z, "frequency", effect=PERIODIC_INTERFERENCE.name, record=r), segment)
        for r, segment in enumerate(model.segments)
    )


def strongest_lines(fit: LoopFit) -> Iterator[SpectralLine]:
    """Find the strongest lines in the residual of the longest record."""
    r = int(np.argmax([segment.values.size for segment in fit.model.segments]))
    segment, noise = fit.model.segments[r], fit.noises[r]
    residual = noise.residual * (noise.weight > 0.0)
    far = settings.SETTINGS.far * noise.sd
    residual = np.clip(residual, -far, far)
    n = residual.size
    size = 1 << (4 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(residual * np.hanning(n), size))
    power[: int(settings.SETTINGS.line_repeats * size / n)] = 0.0
    power[follows_motion(np.fft.rfftfreq(size, segment.decay.step), segment)] = 0.0
    reach = _WIDTH * size // n
    for _ in range(_LINES):
        peak = int(np.argmax(power))
        frequency = peak / (size * segment.decay.step)
        yield SpectralLine(frequency, segment.duration, _sines_and_cosines(fit, frequency))
        power[max(peak - reach, 0) : peak + reach] = 0.0


def _sines_and_cosines(fit: LoopFit, frequency: float) -> list[Array]:
    """Whitened sine and cosine of each record, in columns of its own."""
    columns = []
    for r, segment in enumerate(fit.model.segments):
        angle = 2.0 * math.pi * frequency * segment.time
        pair = np.zeros((segment.values.size, 2 * len(fit.noises)))
        pair[:, 2 * r] = np.sin(angle)
        pair[:, 2 * r + 1] = np.cos(angle)
        columns.append(whiten(pair, fit.noise_models[r].ar))
    return columns
