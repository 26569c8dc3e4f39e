"""A decay of eighteen half cycles by each kind of sensor, whose zero may drift along a line."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=2.0, stiffness=800.0)
FRICTION, AMPLITUDE = 0.4, 0.0203
UNIT = {"displacement": 1.0, "velocity": 20.0, "acceleration": 400.0}


def record(
    quantity: str = "displacement",
    seed: int = 1,
    drift: float = 0.0,
    sampling_rate: float = 200.0,
    **setting: Any,
) -> xr.DataArray:
    """With noise of 0.2 % of the amplitude, and a drift over the whole record in units of that."""
    scale = AMPLITUDE * UNIT[quantity]
    plain = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=AMPLITUDE,
        duration=3.0,
        sampling_rate=sampling_rate,
        noise_sd=2e-3 * scale,
        seed=seed,
        quantity=quantity,
        **setting,
    )
    return plain.copy(data=plain.values + drift * scale * np.linspace(-0.5, 0.5, plain.size))


@cache
def plain_estimate(quantity: str = "displacement", seed: int = 1) -> fb.Estimate:
    """Of a record without fault, which many tests compare with: each is estimated once."""
    return fb.estimate(record(quantity, seed), SYSTEM)


def width(estimate: fb.Estimate) -> float:
    """Of the 90 % interval."""
    low, high = estimate.friction.interval(0.9)
    return float(high - low)
