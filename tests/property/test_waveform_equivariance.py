"""What changes of unit, zero and clock do to an estimate: nothing but the obvious."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from decays import SYSTEM, short_decay
from friction_bayes import Oscillator, estimate_batch

RATE = 50.0
RECORD = short_decay(friction=0.2, duration=12.0, sampling_rate=RATE, noise_sd=4e-4, seed=5).values
METHODS = ("waveform", "envelope", "normal-gamma", "gamma-exponential")
FLAT = {"coefficient_precision": 0.0, "alpha": 0.5, "beta": 0.0}
BASE = estimate_batch(RECORD[None], SYSTEM, sampling_rate=RATE, prior=FLAT)


@cache
def estimated_by(method: str) -> xr.Dataset:
    return estimate_batch(RECORD[None], SYSTEM, sampling_rate=RATE, method=method)


@settings(max_examples=25)
@given(
    scale=st.floats(1e-3, 1e3),
    offset=st.floats(-100.0, 100.0),
    speed=st.floats(0.01, 100.0),
    flip=st.booleans(),
)
def test_scale_offset_clock_and_sign(scale: float, offset: float, speed: float, flip: bool) -> None:
    values = (-1.0 if flip else 1.0) * scale * RECORD + scale * 0.02 * offset
    system = Oscillator(mass=10.0, stiffness=1000.0 * speed**2)
    result = estimate_batch(values[None], system, sampling_rate=RATE * speed, prior=FLAT)
    assert result["status"].item() == 0
    ratio = scale * speed**2
    assert result["friction_mean"].item() == pytest.approx(ratio * BASE["friction_mean"].item(), rel=1e-6)
    assert result["friction_sd"].item() == pytest.approx(ratio * BASE["friction_sd"].item(), rel=1e-6)
    assert result["noise_sd"].item() == pytest.approx(scale * BASE["noise_sd"].item(), rel=1e-6)
    assert result["frequency"].item() == pytest.approx(speed * BASE["frequency"].item(), rel=1e-7)
    assert np.sign(result["friction_mean"].item()) == 1.0


@settings(max_examples=25)
@given(exponent=st.floats(-12.0, 12.0))
@pytest.mark.parametrize("method", METHODS)
def test_results_scale_with_the_signal(method: str, exponent: float) -> None:
    scale = 10.0**exponent
    base = estimated_by(method)
    result = estimate_batch(scale * RECORD[None], SYSTEM, sampling_rate=RATE, method=method)
    # the mean of the gamma-exponential pair tends to one over friction
    power = -1.0 if method == "gamma-exponential" else 1.0
    for name in ("friction_mean", "friction_sd", "friction_interval90"):
        assert result[name].values == pytest.approx(scale**power * base[name].values, rel=1e-5)
    assert result["status"].item() == 0
