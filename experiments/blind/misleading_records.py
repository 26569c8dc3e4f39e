"""Plain Coulomb decays of the rig of :mod:`experiments.blind.near_threshold` that mislead all the same.

Noise that is not white, an accelerometer, a declared stiffness that is off, and two releases whose friction
differs. There is no effect of the catalogue's laws in any of them.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.blind.draws import either_sign, log_uniform
from experiments.blind.laws import Law, integrate
from experiments.blind.near_threshold import (
    AMPLITUDE,
    DISSIPATION,
    DURATION,
    FREQUENCY,
    NOISE,
    SAMPLING_RATE,
    SYSTEM,
    ThresholdRecord,
)
from friction_bayes import make_record

__all__ = ["MISLEADING", "draw_misleading"]

Array = NDArray[np.float64]

MISLEADING = {
    "growing_noise": (0.005, 4.0),
    "pink_noise": (0.003, 3.0),
    "shared_error": (0.003, 3.0),
    "accelerometer": (400.0, 20_000.0),
    "declared_off": (2e-4, 0.05),
    "differing_releases": (1e-3, 0.1),
}
"""For each kind between what its size is drawn, log-uniform.

growing_noise
    Noise in proportion to the displacement, at the release, over the sensor's white noise.
pink_noise
    Noise whose power goes as one over the frequency, added to the white noise; its sd over that.
shared_error
    Noise correlated over 0.01 .. 0.05 s, added to the white noise; its sd over that.
accelerometer
    Sampling rate [Hz], at 40 .. 60 dB.
declared_off
    Relative error of the declared stiffness, of either sign.
differing_releases
    Relative difference of friction between two records, the second released from half the amplitude.
"""


def draw_misleading(kind: str, seed: np.random.SeedSequence | int) -> ThresholdRecord:
    """Draw the records of a kind of :data:`MISLEADING`; the seed decides everything."""
    rng = np.random.default_rng(seed)
    if kind not in MISLEADING:
        raise ValueError(f"unknown kind {kind!r}, one of {', '.join(MISLEADING)}")
    size = log_uniform(rng, *MISLEADING[kind])
    declared = dict(SYSTEM)
    if kind == "accelerometer":
        return ThresholdRecord(records=(_accelerations(size, rng),), kind=kind, size=size)
    if kind == "differing_releases":
        step = either_sign(rng) * 0.5 * size
        releases = ((1.0, 1.0 + step), (0.5, 1.0 - step))
        pair = tuple(_recorded(_displacements(*release), rng) for release in releases)
        return ThresholdRecord(records=pair, kind=kind, size=size)
    if kind == "declared_off":
        declared["stiffness"] *= 1.0 + either_sign(rng) * size
    clean = _displacements(1.0, 1.0)
    n, added = clean.size, np.zeros(clean.size)
    if kind == "growing_noise":
        added = size * clean / AMPLITUDE * rng.standard_normal(n)
    if kind == "pink_noise":
        added = size * _pink(n, rng)
    if kind == "shared_error":
        added = size * _shared(n, rng.uniform(0.01, 0.05), rng)
    record = _recorded(clean + NOISE * added, rng)
    return ThresholdRecord(records=(record,), kind=kind, size=size, declared=declared)


def _displacements(start: float, friction: float) -> Array:
    times = np.arange(0.0, DURATION, 1.0 / SAMPLING_RATE) * FREQUENCY
    law = Law(friction=friction * DISSIPATION)
    return AMPLITUDE * integrate(law, start, 0.0, DURATION * FREQUENCY).sample(times)[0]


def _recorded(signal: Array, rng: np.random.Generator) -> xr.DataArray:
    noisy = signal + NOISE * rng.standard_normal(signal.size)
    time = np.arange(signal.size) / SAMPLING_RATE
    return make_record(time, noisy, "displacement", name="sealed record", synthetic=True)


def _accelerations(rate: float, rng: np.random.Generator) -> xr.DataArray:
    time = np.arange(0.0, DURATION, 1.0 / rate)
    motion = integrate(Law(friction=DISSIPATION), 1.0, 0.0, DURATION * FREQUENCY)
    clean = AMPLITUDE * FREQUENCY**2 * motion.sample(time * FREQUENCY)[1]
    noise = float(np.sqrt(np.mean(clean**2))) * 10.0 ** (-rng.uniform(40.0, 60.0) / 20.0)
    noisy = clean + noise * rng.standard_normal(clean.size)
    return make_record(time, noisy, "acceleration", name="sealed record", synthetic=True)


def _pink(n: int, rng: np.random.Generator) -> Array:
    """Noise of unit variance with power as one over the frequency, from that of the record on."""
    size = np.zeros(n // 2 + 1)
    size[1:] = 1.0 / np.sqrt(np.arange(1, size.size))
    noise = np.fft.irfft(size * (rng.standard_normal(size.size) + 1j * rng.standard_normal(size.size)), n)
    return noise / np.std(noise)


def _shared(n: int, correlation_time: float, rng: np.random.Generator) -> Array:
    """Stationary noise of unit variance that forgets exponentially."""
    memory = math.exp(-1.0 / (SAMPLING_RATE * correlation_time))
    noise = rng.standard_normal(n)
    for i in range(1, n):
        noise[i] = memory * noise[i - 1] + math.sqrt(1.0 - memory**2) * noise[i]
    return noise
