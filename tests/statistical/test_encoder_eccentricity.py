"""Eccentricity of an encoder is found where it is; none is invented in ``test_plain_decays.py``.

Wheels of a simulator of their own, with a force that fluctuates. An error of twice the noise was found in
11 of 20, of three times the noise in all of 20; where half of these are missed it is seen in 81 % of runs.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from curtailed import at_least
from unsteady_decays import WHEEL, WHEEL_NOISE, eccentric_record, fitted, probability_of

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "encoder_eccentricity")


def probabilities(rng: np.random.Generator, size: float, count: int) -> Iterator[float]:
    for _ in range(count):
        phases = rng.uniform(-np.pi, np.pi, 2)
        fit = fitted(eccentric_record(rng, size, tuple(phases)), OFFERED, WHEEL)
        yield probability_of(fit, "encoder_eccentricity")


def test_an_error_of_three_times_the_noise_is_found(rng: np.random.Generator) -> None:
    assert at_least(4, (each > 0.9 for each in probabilities(rng, 3.0 * WHEEL_NOISE, 5)))
