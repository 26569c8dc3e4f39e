"""Decays of one oscillator through filters of SciPy."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy import signal

import friction_bayes as fb
from friction_bayes.core.arrays import Array

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
NOISE = {"displacement": 2e-5, "velocity": 2e-4, "acceleration": 2e-3}


def decay(
    quantity: str = "displacement",
    *,
    start: float = 0.05,
    duration: float = 12.0,
    rate: float = 200.0,
    effects: dict[str, float] | None = None,
) -> xr.DataArray:
    """A decay under 1 N of dry friction, as it was before any filter."""
    return fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=start,
        duration=duration,
        sampling_rate=rate,
        noise_sd=NOISE[quantity],
        seed=3,
        quantity=quantity,
        effects=effects,
    )


def filtered(
    quantity: str,
    corner: float,
    *,
    order: int = 2,
    lost: int = 0,
    rate: float = 200.0,
    both: bool = False,
    start: float = 0.05,
    duration: float = 12.0,
    effects: dict[str, float] | None = None,
) -> xr.DataArray:
    """Such a decay through a Butterworth filter, causal or forward and backward, some samples lost."""
    record = decay(quantity, start=start, duration=duration, rate=rate, effects=effects)
    b, a = signal.butter(order, corner, fs=rate)
    values = (signal.filtfilt if both else signal.lfilter)(b, a, record.values)
    kept = np.ones(values.size, dtype=bool)
    kept[700 : 700 + lost] = False
    return fb.make_record(record["time"].values[kept], values[kept], quantity)


def settled(sections: Array, *, noise_sd: float, seed: int) -> xr.DataArray:
    """A decay at 240 Hz under 1 N of dry friction through a causal filter that had settled before it."""
    motion = fb.simulate(
        SYSTEM,
        friction=1.0,
        initial_displacement=0.08,
        duration=12.0,
        sampling_rate=240.0,
        noise_sd=noise_sd,
        seed=seed,
    )
    state = signal.sosfilt_zi(sections) * motion.values[0]
    values, _ = signal.sosfilt(sections, motion.values, zi=state)
    return fb.make_record(motion["time"].values, values, "displacement")
