"""The oscillator and the free decays that most tests start from."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import friction_bayes as fb

# It swings at 10 rad/s; a friction of 1 N shifts each half cycle by 1 mm.
SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)


def short_decay(system: fb.Oscillator = SYSTEM, **settings: Any) -> xr.DataArray:
    """Simulate a decay from 20 mm under 0.5 N: eight periods, 63 samples each, and 0.1 mm of noise."""
    usual = {
        "friction": 0.5,
        "initial_displacement": 0.02,
        "duration": 5.0,
        "sampling_rate": 100.0,
        "noise_sd": 1e-4,
        "seed": 1,
    }
    return fb.simulate(system, **usual | settings)


def long_decay(system: fb.Oscillator = SYSTEM, **settings: Any) -> xr.DataArray:
    """Simulate a decay from 50 mm under 0.25 N: 19 periods, 38 samples each, and 0.5 mm of noise."""
    usual = {
        "friction": 0.25,
        "initial_displacement": 0.05,
        "duration": 12.0,
        "sampling_rate": 60.0,
        "noise_sd": 5e-4,
    }
    return fb.simulate(system, **usual | settings)


def slow_decay(system: fb.Oscillator = SYSTEM, **settings: Any) -> xr.DataArray:
    """Simulate a decay from 14.7 mm under 0.07 N: 22 periods, 126 samples each, and 0.2 mm of noise.

    It loses four tenths of its amplitude, so that damping is hardly separated from friction.
    """
    usual = {
        "friction": 0.07,
        "initial_displacement": 0.0147,
        "duration": 14.0,
        "sampling_rate": 200.0,
        "noise_sd": 2e-4,
    }
    return fb.simulate(system, **usual | settings)


def fluctuating_friction(share: float = 0.3) -> dict[str, float]:
    """Effects of a :func:`slow_decay` whose friction fluctuates by a share, correlated over 0.1 s."""
    return {"random_force.sd": share * 0.07, "random_force.correlation_time": 0.1}


def written_decay(
    time: NDArray[np.float64], amplitude: float, shift: float, frequency: float = 10.0
) -> NDArray[np.float64]:
    """Write down a decay from rest, without the package: each half cycle a cosine about ``+-shift``.

    The first turning point lies at ``amplitude``, each further one ``2 shift`` nearer to rest.
    """
    half_cycle = np.floor(frequency * time / np.pi)
    swing = amplitude - (2.0 * half_cycle + 1.0) * shift
    return swing * np.cos(frequency * time) + shift * (-1.0) ** half_cycle


def recording_of_decays(
    amplitudes: tuple[float, ...] = (0.02, 0.02, 0.012), *, shift: float = 5e-4, rate: float = 100.0
) -> NDArray[np.float64]:
    """Write down releases in a row: drawn to each in 0.5 s, held for 0.7 s, free for 8 s."""
    signal: list[NDArray[np.float64]] = []
    for amplitude in amplitudes:
        from_rest = signal[-1][-1] if signal else amplitude
        drawn = np.sin(0.5 * np.pi * np.arange(round(0.5 * rate)) / (0.5 * rate)) ** 2
        time = np.arange(round(8.0 * rate)) / rate
        stop = np.pi / 10.0 * np.floor(0.5 * (amplitude / shift + 1.0))
        signal += [
            from_rest + (amplitude - from_rest) * drawn,
            np.full(round(0.7 * rate), amplitude),
            written_decay(np.minimum(time, stop), amplitude, shift),
        ]
    return np.concatenate(signal)


PUSHED_UNTIL = 0.6
"""When the hand of :func:`pushed_decay` has let go [s], nearly two half cycles after the release."""


def pushed_decay(*, push: float = 3.0, noise_sd: float = 1e-4, seed: int = 1) -> xr.DataArray:
    """Integrate a decay from 50 mm under 0.25 N that a force [N] swells and fades upon, as of a hand.

    Mass and stiffness are those of ``SYSTEM``; it ends in motion.
    """
    step, friction = 2e-4, 0.25
    x, v, signal = 0.05, 0.0, []
    for i in range(60_000):
        t = i * step
        hand = push * math.sin(math.pi * t / PUSHED_UNTIL) ** 2 if t < PUSHED_UNTIL else 0.0
        if i % 50 == 0:
            signal.append(x)
        v += step * (-1000.0 * x - math.copysign(friction, v) + hand) / 10.0
        x += step * v
    noise = noise_sd * np.random.default_rng(seed).standard_normal(len(signal))
    time = 50 * step * np.arange(len(signal))
    return fb.make_record(time, np.array(signal) + noise, "displacement", name="pushed.csv")
