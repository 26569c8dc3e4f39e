"""A bent scale of the sensor is found where it is; none is invented in ``test_plain_decays.py``.

Decays of a simulator of their own, with a force that fluctuates. An error of twice the noise at the release
was found in 6 of 10, of three times the noise in all of 10; where half of these are missed it is seen in
81 % of runs.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from curtailed import at_least
from unsteady_decays import RELEASE, WHITE, bent_record, fitted, probability_of

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "sensor_nonlinearity")


def probabilities(rng: np.random.Generator, curvature: float, count: int) -> Iterator[float]:
    records = (bent_record(rng, curvature) for _ in range(count))
    return (probability_of(fitted(record, OFFERED), "sensor_nonlinearity") for record in records)


def test_an_error_of_three_times_the_noise_is_found(rng: np.random.Generator) -> None:
    assert at_least(4, (each > 0.9 for each in probabilities(rng, 3.0 * WHITE / RELEASE, 5)))
