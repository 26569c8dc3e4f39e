"""From a drawn rig to a recording: how long, how fast, begun where, with how much noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.ordinary.processing import Process, gain_at
from experiments.ordinary.rig import SENSORS, Motion, OrdinaryRecord, Rig

__all__ = ["Layout", "draw_layout", "log_uniform", "noise_for", "recorded"]

_MOST_AT_REST = 0.8
"""Half cycles to rest over those recorded, at the least: the last fifth of a recording may be at rest."""
_LONGEST_LEFT = 4.0
"""The same at the most."""
_LEAST_MOVING = 4.2
"""Half cycles of motion after the first sample, at the least."""
_LATEST_BEGIN = 4.0
"""Half cycles after the release at which a recording in mid-motion begins, at the most."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a positive number, its logarithm uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


@dataclass(frozen=True, kw_only=True)
class Layout:
    """A rig, its release, and the instants of the samples.

    Attributes
    ----------
    rig : Rig
    amplitude : float
        Displacement at the release [m], of either sign.
    begin : float
        Of the recording, after the release [s]; 0 where it begins with it.
    step : float
        Between samples [s].
    samples : int
    """

    rig: Rig
    amplitude: float
    begin: float
    step: float
    samples: int

    @property
    def end(self) -> float:
        """Of the recording, after the release [s]."""
        return self.begin + self.step * self.samples

    @property
    def per_period(self) -> float:
        """Samples a period."""
        return self.rig.period / self.step


def draw_layout(
    rng: np.random.Generator,
    *,
    half_cycles: tuple[float, float] = (4.0, 60.0),
    per_period: tuple[float, float] = (60.0, 500.0),
    to_rest: tuple[float, float] = (_MOST_AT_REST, _LONGEST_LEFT),
    from_release: bool | None = None,
) -> Layout:
    """Draw a rig and how it is recorded.

    Parameters
    ----------
    rng : Generator
    half_cycles, per_period : tuple of float
        Smallest and largest number of half cycles recorded, and of samples a period.
    to_rest : tuple of float
        Half cycles from the first sample to rest over those recorded.
    from_release : bool, optional
        Whether the recording begins with the release; every other one does when left out.
    """
    mass = log_uniform(rng, 0.05, 50.0)
    frequency = 2.0 * math.pi * log_uniform(rng, 0.5, 20.0)
    amplitude = log_uniform(rng, 2e-3, 0.1) * float(rng.choice([-1.0, 1.0]))
    recorded_half_cycles = log_uniform(rng, *half_cycles)
    moving = max(recorded_half_cycles * log_uniform(rng, *to_rest), _LEAST_MOVING)
    if from_release is None:
        from_release = bool(rng.random() < 0.5)
    late = 0.0 if from_release else rng.uniform(0.3, _LATEST_BEGIN)
    stiffness = mass * frequency**2
    # the amplitude falls by twice friction over stiffness in each half cycle
    friction = stiffness * abs(amplitude) / (2.0 * (moving + late))
    step = 2.0 * math.pi / frequency / log_uniform(rng, *per_period)
    return Layout(
        rig=Rig(mass, stiffness, friction),
        amplitude=amplitude,
        begin=late * math.pi / frequency,
        step=step,
        samples=round(recorded_half_cycles * math.pi / frequency / step),
    )


def noise_for(clean: NDArray[np.float64], snr_db: float) -> float:
    """Standard deviation of a noise that many decibels below that of a signal."""
    return float(np.std(clean)) * 10.0 ** (-snr_db / 20.0)


def recorded(
    rng: np.random.Generator,
    layout: Layout,
    motion: Motion,
    sensor: str,
    *,
    snr_db: float | None = None,
    noise_sd: float | None = None,
    process: Process | None = None,
    margin: int = 0,
    order: int = 0,
    after: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    **facts: float,
) -> OrdinaryRecord:
    """Record a motion: sensor, white noise, what the signal goes through, and the cut.

    Parameters
    ----------
    rng : Generator
        Of the noise.
    layout : Layout
    motion : Motion
    sensor : {"displacement", "velocity", "acceleration"}
        What is sensed.
    snr_db, noise_sd : float
        Of the sensor's noise, one of the two: decibels below the standard deviation of the signal, or in its
        unit.
    process : Process, optional
        What signal and noise go through.
    margin : int
        Samples recorded before and after, gone through with the others and cut then.
    order : int
        How many times the process differentiates: the file contains the derivative of what is sensed.
    after : callable, optional
        What comes on top of the processed signal, such as noise of the recorder.
    **facts : float
        What else was drawn.
    """
    times = layout.begin + layout.step * np.arange(-margin, layout.samples + margin, dtype=np.float64)
    clean = motion.sample(times, sensor)
    kept = slice(margin, margin + layout.samples)
    if noise_sd is None:
        if snr_db is None:
            raise ValueError("neither snr_db nor noise_sd was given")
        noise_sd = noise_for(clean[kept], snr_db)
    values = clean + noise_sd * rng.standard_normal(clean.size)
    gain = 1.0
    if process is not None:
        values = process(values)
        gain = gain_at(process, layout.rig.frequency, layout.step, order)
    values = values[kept]
    if after is not None:
        values = after(values)
    return OrdinaryRecord(
        times=layout.step * np.arange(layout.samples, dtype=np.float64),
        values=values,
        quantity=SENSORS[SENSORS.index(sensor) + order],
        mass=layout.rig.mass,
        stiffness=layout.rig.stiffness,
        truth=lambda start, stop: motion.mean_friction(layout.begin + start, layout.begin + stop),
        gain=gain,
        facts={
            "half_cycles": layout.samples * layout.step / layout.rig.period * 2.0,
            "per_period": layout.per_period,
            "noise_over_signal": noise_sd / float(np.std(clean[kept])),
            **facts,
        },
    )
