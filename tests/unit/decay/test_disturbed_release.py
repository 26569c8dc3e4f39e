"""A hand that had not let go yet is found and cut; what follows the motion from start to end is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

import friction_bayes as fb
from decays import PUSHED_UNTIL, SYSTEM, long_decay, pushed_decay
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.decay.location import locate_free_decays

FRICTION = 0.25
HALF_CYCLE = math.pi / 10.0
STRUCTURE = {
    "none": {},
    "viscous damping": {"viscous_damping.damping_ratio": 0.003},
    "quadratic drag": {"quadratic_drag.drag_coefficient": 2.0},
    "Stribeck": {"stribeck_friction.static_excess": 1.0, "stribeck_friction.stribeck_velocity": 0.1},
    "pre-sliding": {"presliding.displacement": 5e-4},
    "asymmetric": {"asymmetric_friction.asymmetry": 0.5},
    "drift": {"friction_drift.relative_change": -1.0},
    "cubic": {"cubic_stiffness.cubic_stiffness": 3e4},
    "clipped": {"sensor_clipping.level": 0.045},
    "offset": {"sensor_offset.offset": 5e-3},
}


@pytest.mark.parametrize("push", [-6.0, -3.0, 3.0, 6.0])
def test_a_hand_is_cut_at_the_first_turning_point_after(push: float, seed: int) -> None:
    decay = find_free_decay(pushed_decay(push=push, seed=seed), SYSTEM)
    # one that pushes along leaves no loss, as a drive does
    assert decay.disturbed in (2, 3) or (push > 0.0 and decay.driven)
    assert PUSHED_UNTIL <= decay.start_time <= PUSHED_UNTIL + 2.0 * HALF_CYCLE
    assert math.sin(decay.phase) == pytest.approx(0.0, abs=0.2)
    (note,) = decay.notes
    cut = "no amplitude was lost up to" if decay.driven else "the release was still disturbed, as by a hand"
    assert note.startswith(f"pushed.csv: {cut}")
    assert f"{decay.start_time:.4g} s" in note


def test_friction_after_the_cut_is_right(seed: int) -> None:
    record = pushed_decay(seed=seed)
    blind, cut = (fb.estimate(record, SYSTEM, start=start) for start in (0.0, None))
    assert abs(cut.friction.mean() - FRICTION) < 0.01 * FRICTION
    assert cut.friction.std() < 0.2 * blind.friction.std()
    assert cut.decay.notes[0] in cut.notes
    assert blind.decay.disturbed == 0
    assert not blind.decay.notes


@pytest.mark.parametrize("effects", STRUCTURE.values(), ids=STRUCTURE)
def test_structure_is_no_hand(effects: dict[str, float], seed: int) -> None:
    record = long_decay(seed=seed, effects=effects)
    assert find_free_decay(record, SYSTEM).disturbed == 0


def test_a_hold_before_the_release_is_no_hand(seed: int) -> None:
    record = long_decay(seed=seed)
    held = np.concatenate([np.full(90, record.values[0]), record.values])
    decay = find_free_decay(fb.make_record(np.arange(held.size) / 60.0, held, "displacement"), SYSTEM)
    assert decay.start_time == pytest.approx(1.5, abs=0.4 * HALF_CYCLE)
    assert decay.disturbed == 0


def test_few_half_cycles_tell_a_hand_and_fewer_do_not() -> None:
    decays = [find_free_decay(pushed_decay().isel(time=slice(0, n)), SYSTEM) for n in (660, 250)]
    assert [decay.disturbed > 0 or decay.driven for decay in decays] == [True, False]


def test_false_alarms_are_one_in_a_hundred_at_most(rng: np.random.Generator) -> None:
    """The level is that of steps that scatter normally; three binomial sd above it."""
    draws = 1000
    clean = long_decay(noise_sd=0.0, seed=1).values
    records = clean + 5e-4 * rng.standard_normal((draws, clean.size))
    found = locate_free_decays(records, 1.0 / 60.0, SYSTEM.natural_frequency, 0)
    assert np.count_nonzero(found.disturbed) <= 0.01 * draws + 3.0 * math.sqrt(0.01 * draws)


def test_one_record_or_many_are_cut_alike(seed: int) -> None:
    records = np.stack([pushed_decay(push=push, seed=seed).values for push in (-6.0, 0.0, 6.0)])
    together = locate_free_decays(records, 0.01, SYSTEM.natural_frequency, 0)
    np.testing.assert_array_equal((together.disturbed > 0) | together.driven, [True, False, True])
    with pytest.warns(fb.RecordWarning, match="2 of 3 records have warnings .*are? left out"):
        many = fb.estimate_batch(records, SYSTEM, sampling_rate=100.0, random_force="none")
    np.testing.assert_allclose(many["friction_mean"], FRICTION, rtol=0.01)
