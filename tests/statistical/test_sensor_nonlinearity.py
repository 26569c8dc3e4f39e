"""A bent scale of the sensor is found where it is and not where it is not.

Decays of a simulator of their own, with a force that fluctuates. Of 40 straight scales none had a
probability above 0.03, and one invented in a record of five is seen in 93 % of runs; an error of the size
of the noise at the release was found in 5 of 10, of twice that in all of 10.
"""

from __future__ import annotations

import numpy as np

from unsteady_decays import RELEASE, WHITE, bent_record, fitted, probability_of

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "sensor_nonlinearity")


def probabilities(rng: np.random.Generator, curvature: float, count: int) -> np.ndarray:
    records = (bent_record(rng, curvature) for _ in range(count))
    return np.array([probability_of(fitted(record, OFFERED), "sensor_nonlinearity") for record in records])


def test_none_is_invented(rng: np.random.Generator) -> None:
    assert np.all(probabilities(rng, 0.0, 12) < 0.5)


def test_an_error_of_twice_the_noise_is_found(rng: np.random.Generator) -> None:
    assert np.sum(probabilities(rng, 2.0 * WHITE / RELEASE, 8) > 0.9) >= 7
