"""What one reading of the samples rules out, the longer looks do not find."""

from __future__ import annotations

import numpy as np
import pytest

from friction_bayes.core.arrays import Array
from friction_bayes.decay.excursions import excursions_possible, without_excursions
from friction_bayes.decay.leaps import find_leap, may_leap
from friction_bayes.decay.spans import extremes
from friction_bayes.records.clipping import clipped_fraction

SAMPLES, ANGLE = 400, 0.06


@pytest.fixture
def rows(rng: np.random.Generator) -> Array:
    """Decays under noise of any size, with a stray sample or two, a slip or a flat top of any size."""
    time = ANGLE * np.arange(SAMPLES)
    rows = np.cos(time + rng.uniform(0.0, 6.0, (300, 1))) * (1.0 - time / time[-1])
    rows += np.exp(rng.uniform(np.log(1e-4), 0.0, (300, 1))) * rng.standard_normal(rows.shape)
    for k, row in enumerate(rows):
        at, size = int(rng.integers(3, SAMPLES - 3)), float(np.exp(rng.uniform(-4.0, 1.5)))
        if k % 4 == 0:
            row[at : at + 1 + k % 3] += size
        elif k % 4 == 1:
            row[at:] += size
        elif k % 4 == 2:
            np.minimum(row, 1.0 / (1.0 + size), out=row)
    return rows


def test_nothing_is_missed_and_most_is_ruled_out(rows: Array) -> None:
    seen = extremes(rows)
    possible = {
        "stray": excursions_possible(seen),
        "leap": np.array([may_leap(*each) for each in zip(rows, seen.gap, strict=True)]),
        "flat": seen.flat,
    }
    found = {
        "stray": np.array([without_excursions(row, ANGLE)[1].size > 0 for row in rows]),
        "leap": np.array([find_leap(row) is not None for row in rows]),
        "flat": np.array([clipped_fraction(row)[1] is not None for row in rows]),
    }
    for name, passed in possible.items():
        assert found[name].sum() > 10, name
        assert not np.any(found[name] & ~passed), name
        assert passed.mean() < 0.7, name


@pytest.mark.parametrize("samples", [2, 9, 262, 263, 264, 1500])
def test_what_is_compared_side_by_side_is_what_is_compared_one_by_one(
    samples: int, rng: np.random.Generator
) -> None:
    """Of records longer and shorter than what is compared at a time, wherever the farthest sample lies."""
    rows = rng.standard_normal((40, samples))
    rows[np.arange(40), rng.integers(samples, size=40)] *= 5.0
    seen = extremes(rows)
    ahead = [np.abs(rows[:, k:] - rows[:, :-k]).max(axis=1) for k in (1, 2, 3) if k < samples]
    np.testing.assert_array_equal(seen.low, rows.min(axis=1))
    np.testing.assert_array_equal(seen.high, rows.max(axis=1))
    # no less, and no more by much
    rounding = 3e-6 * np.ptp(rows, axis=1)
    widest = np.max(ahead, axis=0)
    assert np.all((widest <= seen.widest) & (seen.widest <= widest + rounding))
    onward = np.array([0.85, 0.45, 0.05, -0.35])
    gaps = [np.convolve(row, [*onward[::-1], *-onward], "valid") for row in rows] if samples > 7 else [[0.0]]
    widest = np.abs(gaps).max(axis=1)
    assert np.all((widest <= seen.gap) & (seen.gap <= widest + rounding))


@pytest.mark.parametrize("at", [0, 1022, 1023, 1024, 2046, 2998])
def test_a_repeat_is_seen_wherever_it_is(at: int, rng: np.random.Generator) -> None:
    rows = rng.standard_normal((2, 3000))
    rows[1, at + 1] = rows[1, at]
    assert extremes(rows).repeats.tolist() == [False, True]


def test_a_record_that_is_not_finite_is_not_looked_at(rows: Array) -> None:
    rows[:3, 7] = [np.nan, np.inf, -np.inf]
    seen = extremes(rows)
    assert seen.finite.tolist() == [False] * 3 + [True] * (len(rows) - 3)
    assert not excursions_possible(seen)[:3].any()
