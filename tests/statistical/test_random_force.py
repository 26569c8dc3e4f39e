"""Intervals under a fluctuating force cover, and cost little where there is none.

The records come from a simulator of their own. Coverage of 28 records at 0.86 and above falls below the limit
in about one run of 1,200; the median width of 24 records without a force, whose ratio scatters by a few per
cent, passes its limit in about one of 1,000. Nor is one found in records that are quieter still, or of
many samples: there the turning points of the path along which the forces act have to be right.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from itertools import chain, tee

import numpy as np
import pytest

import friction_bayes as fb
from curtailed import at_least
from fluctuating_force import fluctuating_decay

SYSTEM = fb.Oscillator(mass=1.0, stiffness=100.0)
RELEASE, STEP = 0.02, 0.02


def estimates(
    rng: np.random.Generator, share: float, count: int, *, noise: float = 0.0028, step: float = STEP
) -> Iterator[tuple[bool, float]]:
    """Whether each interval covers the truth, and its width over that of the plain fit.

    A force passes for an uneven loss in one record of some 400, which is warned of; two of 24 come in one run
    of 600.
    """
    warned = 0
    for _ in range(count):
        friction = RELEASE / rng.uniform(80.0, 160.0)
        values = fluctuating_decay(
            rng,
            frequency=10.0,
            friction=friction,
            release=RELEASE,
            step=step,
            samples=round(22.0 / step),
            force_sd=share * friction,
            correlation_time=rng.uniform(0.05, 0.3),
            # in steps of a twentieth of the shortest correlation time; without a force any step is exact
            oversampling=8 if share > 0.0 else 1,
        )[0]
        values = values + noise * RELEASE * rng.standard_normal(values.size)
        record = fb.make_record(step * np.arange(values.size), values, "displacement")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = fb.estimate(record, SYSTEM)
        assert all("while it is larger" in str(each.message) for each in caught)
        warned += len(caught)
        low, high = found.friction.interval(0.9)
        plain = np.subtract(*found.random_force.coefficient_without.interval(0.9)[::-1])
        truth = friction * SYSTEM.stiffness
        assert warned <= 1
        yield bool(low <= truth <= high), (high - low) / plain


def test_coverage_with_a_force(rng: np.random.Generator) -> None:
    large, again = tee(estimates(rng, 0.3, 6))
    assert at_least(4, (width > 3.0 for _, width in large))
    # of 90 % intervals six of 12 miss in one run of 1,800, of 50 % intervals in six of ten
    assert at_least(7, (covers for covers, _ in chain(again, estimates(rng, 0.1, 6))))


def test_width_without_one(rng: np.random.Generator) -> None:
    none, again = tee(estimates(rng, 0.0, 24))
    assert at_least(13, (width < 1.1 for _, width in none))
    assert at_least(16, (covers for covers, _ in again))


@pytest.mark.parametrize(("noise", "step"), [(7e-5, STEP), (4e-3, 2e-4)])
def test_width_without_one_of_records_that_say_much(
    noise: float, step: float, rng: np.random.Generator
) -> None:
    covers, width = np.array(list(estimates(rng, 0.0, 8, noise=noise, step=step))).T
    assert np.median(width) < 1.1
    assert np.max(width) < 2.0
    # five of eight outside happen in one run of 2,000
    assert covers.sum() >= 4
