"""A velocity behind a pickup that is an oscillator itself: its transient is of the sensor, not of the law."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import bilinear, lfilter

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=5.0, stiffness=5.0 * (16.0 * math.pi) ** 2)
FRICTION = 0.3
OFFERED = ["viscous_damping", "friction_drift", "presliding", "sensor_offset", "random_force"]


def test_what_a_geophone_remembers_is_no_force() -> None:
    """Corner 1 Hz, motion at 8 Hz: with the memory of a first order alone the forecast failed."""
    motion = fb.simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=8.5e-4,
        duration=1.0,
        sampling_rate=400.0,
        quantity="velocity",
    )
    corner = 2.0 * math.pi
    shown = lfilter(*bilinear([1.0, 0.0, 0.0], [1.0, 1.4 * corner, corner**2], 400.0), motion.values)
    noise = 2e-4 * np.random.default_rng(4).standard_normal(shown.size)
    report = fb.close_loop(
        fb.make_record(motion["time"].values, shown + noise, "velocity"), SYSTEM, effects=OFFERED
    )
    assert report.verdict in {"adequate", "explained"}
    low, high = report.friction_after["interval90"]
    assert low < FRICTION < high < low + 0.03 * FRICTION
