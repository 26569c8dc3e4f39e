"""Leaps of a position: found where two recordings are pasted, and not in a motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import friction_bayes as fb
from decays import SYSTEM, slow_decay
from friction_bayes.decay.leaps import find_leap
from friction_bayes.estimators.batch import STATUS


def pasted(first: int, *, rate: float = 100.0) -> np.ndarray:
    one, other = (
        slow_decay(friction=0.07, duration=10.0, sampling_rate=rate, noise_sd=1e-5, seed=seed).values
        for seed in (1, 2)
    )
    return np.concatenate([one[:first], other])


@pytest.mark.parametrize("first", [220, 340, 452])
def test_a_pasted_recording_leaps_where_it_is_pasted(first: int) -> None:
    values = pasted(first)
    found = find_leap(values)
    assert found is not None
    index, size = found
    assert index == first - 1
    assert size == pytest.approx(values[first] - values[first - 1], abs=0.1 * np.ptp(values))


def test_it_is_refused_by_its_place_and_a_remedy() -> None:
    record = fb.make_record(0.01 * np.arange(1340), pasted(340), "displacement")
    for call in (fb.estimate, lambda r, s: fb.close_loop([r], s, seed=1)):
        with pytest.raises(fb.InputError, match=r"leaps by .* m at 3.39 s.*start and end"):
            call(record, SYSTEM)


@settings(max_examples=100, deadline=None)
@given(
    samples=st.floats(8.0, 200.0),
    phase=st.floats(0.0, 6.3),
    noise=st.floats(0.0, 0.2),
    step=st.just(0.0) | st.floats(1e-4, 0.05),
    seed=st.integers(0, 2**32 - 1),
)
def test_no_motion_leaps_nor_does_a_stray_sample(
    samples: float, phase: float, noise: float, step: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    turn = 2.0 * np.pi * np.arange(600) / samples
    values = np.exp(-0.01 * turn) * np.cos(turn + phase) + noise * rng.standard_normal(600)
    if step > 0.0:
        values = step * np.round(values / step)
    assert find_leap(values) is None
    values[300] += 0.6
    assert find_leap(values) is None


def test_too_few_samples_say_nothing() -> None:
    assert find_leap(np.array([0.0, 1.0, 0.0])) is None


def test_a_decay_that_is_pasted_to_one_at_rest_begins_after_the_leap() -> None:
    values = np.concatenate([np.full(700, 2e-3), pasted(0)])
    values[:700] += 1e-5 * np.random.default_rng(3).standard_normal(700)
    decay = fb.estimate(fb.make_record(0.01 * np.arange(values.size), values, "displacement"), SYSTEM)
    alone = fb.estimate(fb.make_record(0.01 * np.arange(1000), values[700:], "displacement"), SYSTEM)
    assert decay.friction.mean() == pytest.approx(alone.friction.mean(), rel=1e-6)


@pytest.mark.parametrize("per_period", [80, 100])
def test_a_decay_pasted_to_a_rest_begins_with_its_own_samples(per_period: int) -> None:
    """Of two periods a leap is in one interval of ten, which is no share of them to be usual."""
    rate = per_period * SYSTEM.natural_frequency / (2.0 * np.pi)
    decay = slow_decay(friction=0.07, duration=12.0, sampling_rate=rate, noise_sd=2e-5, seed=3).values
    rest = 2e-5 * np.random.default_rng(4).standard_normal(2 * per_period)
    for first in range(per_period // 8, per_period, 3):
        if abs(decay[first]) < 0.4 * decay[0]:
            # near its middle a decay goes on from the rest
            continue
        values = np.concatenate([rest, decay[first:]])
        record = fb.make_record(np.arange(values.size) / rate, values, "displacement")
        begins = fb.estimate(record, SYSTEM, random_force="none").decay.start_time
        assert round(begins * rate) >= rest.size, first


def test_a_batch_marks_what_estimate_refuses_and_begins_where_it_does() -> None:
    rate = 80 * SYSTEM.natural_frequency / (2.0 * np.pi)
    decay = slow_decay(friction=0.07, duration=12.0, sampling_rate=rate, noise_sd=2e-5, seed=3).values
    other = slow_decay(friction=0.07, duration=12.0, sampling_rate=rate, noise_sd=2e-5, seed=4).values
    rest = 2e-5 * np.random.default_rng(4).standard_normal(160)
    rows = [decay, np.concatenate([decay[:400], other[25:]]), np.concatenate([rest, decay[75:]])]
    size = min(row.size for row in rows)
    many = fb.estimate_batch(
        np.stack([row[:size] for row in rows]), SYSTEM, sampling_rate=rate, random_force="none"
    )
    assert [STATUS[k] for k in many["status"].values] == ["ok", "leaps", "ok"]
    assert np.isnan(many["friction_mean"].values[1])
    for k in (0, 2):
        record = fb.make_record(np.arange(size) / rate, rows[k][:size], "displacement")
        alone = fb.estimate(record, SYSTEM, random_force="none").friction
        assert many["friction_mean"].values[k] == pytest.approx(alone.mean(), rel=1e-9)


def test_what_was_put_into_a_gap_leaps_nowhere(rng: np.random.Generator) -> None:
    """And a leap elsewhere is still there."""
    motion = np.cos(0.05 * np.arange(400)) + 1e-4 * rng.standard_normal(400)
    recorded = np.ones(400, dtype=bool)
    recorded[100:130] = False
    motion[100:115], motion[115:130] = motion[99], motion[130]
    found = find_leap(motion)
    assert found is not None
    assert 110 < found[0] < 120
    assert find_leap(motion, recorded) is None
    motion[300:] += 0.5
    found = find_leap(motion, recorded)
    assert found is not None
    assert found[0] == 299
