"""A second mode is found where it is and not where a line lasts; ``test_plain_decays.py`` has none.

Decays of a simulator of their own, with a force that fluctuates. Of 20 with a line that lasts none had a
probability above 0.002; one invented in a record of six is seen in 66 % of runs. Of lines of twice the noise
that last 1.5 s 5 of 10 were found, of three times the noise 9, of four times all; where half of these are
missed it is seen in 81 % of runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from curtailed import at_least
from unsteady_decays import RELEASE, WHITE, fitted, probability_of, ringing_record

OFFERED = ("viscous_damping", "cubic_stiffness", "sensor_offset", "periodic_interference", "second_mode")


def probabilities(rng: np.random.Generator, size: float, decay_time: float, count: int) -> Iterator[float]:
    """Of a second mode, with a line of ``size`` times the noise in the record."""
    records = (ringing_record(rng, size * WHITE / RELEASE, decay_time) for _ in range(count))
    return (probability_of(fitted(record, OFFERED), "second_mode") for record in records)


def test_a_line_that_lasts_is_none(rng: np.random.Generator) -> None:
    assert all(each < 0.5 for each in probabilities(rng, 1.0, math.inf, 6))


def test_one_of_four_times_the_noise_is_found(rng: np.random.Generator) -> None:
    assert at_least(4, (each > 0.9 for each in probabilities(rng, 4.0, 1.5, 5)))
