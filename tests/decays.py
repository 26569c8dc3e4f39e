"""The oscillator and the free decays that most tests start from."""

from __future__ import annotations

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


def written_decay(
    time: NDArray[np.float64], amplitude: float, shift: float, frequency: float = 10.0
) -> NDArray[np.float64]:
    """Write down a decay from rest, without the package: each half cycle a cosine about ``+-shift``.

    The first turning point lies at ``amplitude``, each further one ``2 shift`` nearer to rest.
    """
    half_cycle = np.floor(frequency * time / np.pi)
    swing = amplitude - (2.0 * half_cycle + 1.0) * shift
    return swing * np.cos(frequency * time) + shift * (-1.0) ** half_cycle
