"""Strongly damped decays with dry friction: where they are released and where they stop."""

from __future__ import annotations

import math

import numpy as np
import pytest

from friction_bayes import Oscillator, make_record
from friction_bayes.core.arrays import Array
from friction_bayes.decay.free_decay import find_free_decay

FREQUENCY, SHIFT = 10.0, 1e-3


def released(time: Array, ratio: float) -> tuple[Array, float]:
    """Motion from rest at 1, shape (n,), under damping and a friction of ``SHIFT``, and when it stops [s]."""
    damped = FREQUENCY * math.sqrt(1.0 - ratio**2)
    half, x = math.pi / damped, np.ones(time.size)
    begin, turn = 0.0, 1.0
    while abs(turn) > SHIFT:
        centre = math.copysign(SHIFT, turn)
        since = time - begin
        angle, fall = damped * since, np.exp(-ratio * FREQUENCY * np.maximum(since, 0.0))
        wave = np.cos(angle) + ratio * FREQUENCY / damped * np.sin(angle)
        x = np.where(since > 0.0, centre + (turn - centre) * fall * wave, x)
        turn = centre - (turn - centre) * math.exp(-ratio * FREQUENCY * half)
        begin += half
        x = np.where(time >= begin, turn, x)
    return x, begin


@pytest.mark.parametrize("hold", [0.0, 0.45])
@pytest.mark.parametrize("ratio", [0.1, 0.17, 0.25])
def test_a_strongly_damped_motion_is_taken_from_its_release_to_its_stop(
    ratio: float, hold: float, rng: np.random.Generator
) -> None:
    time = np.arange(0.0, 5.0 + hold, 0.006)
    x, stop = released(time - hold, ratio)
    record = make_record(time, x + 0.002 * rng.standard_normal(time.size), "displacement")
    decay = find_free_decay(record, Oscillator(mass=1.0, stiffness=FREQUENCY**2))
    half = math.pi / FREQUENCY
    assert abs(decay.start_time - hold) < 0.2 * half
    # the last half cycles are smaller than the noise of a sample
    assert abs(decay.start_time + decay.duration - min(hold + stop, float(time[-1]))) < 2.5 * half
