"""Single samples far outside the noise, which a fit leaves out and says so."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from eighteen_half_cycles import AMPLITUDE, SYSTEM, UNIT, plain_estimate, record, width
from friction_bayes.core.arrays import Array
from friction_bayes.decay.running_ranks import ranks_of_seven
from friction_bayes.estimators.noise.stray_samples import stray_samples


@pytest.mark.parametrize("quantity", list(UNIT))
def test_friction_is_known_as_well_as_without_them(quantity: str) -> None:
    """Three within the range of the motion, halfway from turn to turn, two of them next to each other."""
    plain = record(quantity, 1)
    clean = plain_estimate(quantity)
    places = [47, 48, 110]
    values = plain.values.copy()
    values[places] += AMPLITUDE * UNIT[quantity] * np.array([0.2, -0.15, 0.3])
    found = fb.estimate(plain.copy(data=values), SYSTEM)
    times = plain["time"].values[places]
    assert found.decay.stray == pytest.approx(tuple(times), abs=1e-9)
    assert found.friction.mean() == pytest.approx(clean.friction.mean(), abs=0.3 * width(clean))
    assert width(found) < 1.1 * width(clean)
    assert any(
        f"3 samples lie far outside the noise, the first at {times[0]:.6g} s" in n for n in found.notes
    )


@pytest.mark.parametrize("quantity", list(UNIT))
def test_nothing_is_found_in_noise(quantity: str) -> None:
    """No stray sample, line or drift, in the same records.

    Of 7,200 samples, at five sd and more, by chance one in a million is stray; a search for lines, of which
    there are two, has a false-alarm rate of 1e-4.
    """
    for seed in range(12):
        # they are looked for in what a fit in white noise leaves
        found = fb.estimate(record(quantity, seed), SYSTEM, random_force="none").decay
        assert (found.stray, found.lines, found.drift) == ((), (), 0.0)


def curve(n: int) -> Array:
    return np.sin(np.linspace(0.0, 40.0, n))


def test_what_changes_from_sample_to_sample_as_a_motion_does_is_not_stray(rng: np.random.Generator) -> None:
    """A misfit that is smooth, and one that is spiked at every turn, next to noise a thousandth as large."""
    smooth = curve(2000) + 1e-3 * rng.standard_normal(2000)
    assert not stray_samples(smooth, 10.0).any()
    spiked = curve(2000) ** 21 + 1e-3 * rng.standard_normal(2000)
    assert not stray_samples(spiked, 10.0).any()


def test_ranks_are_those_of_sorting(rng: np.random.Generator) -> None:
    x = np.concatenate([rng.standard_normal(5000), rng.integers(0, 3, 5000)])
    mirrored = np.pad(x, 3, mode="reflect")
    ranked = np.sort(np.lib.stride_tricks.sliding_window_view(mirrored, 7), axis=1)
    np.testing.assert_array_equal(np.transpose(ranks_of_seven(x)), ranked[:, [1, 3, 4]])


def test_the_ends_may_be_stray_but_nothing_in_a_signal_without_noise() -> None:
    lone = np.zeros(100)
    lone[[0, 50, 99]] = 1.0
    assert not stray_samples(lone, 2.0).any()
    lone += 1e-3 * np.cos(np.arange(100) ** 2)
    assert np.flatnonzero(stray_samples(lone, 2.0)).tolist() == [0, 50, 99]
    assert np.flatnonzero(stray_samples(lone, 2.0, 2.0 * (lone < 0.5))).tolist() == [0, 50, 99]
    assert not stray_samples(lone, 2.0, 2.0 * (lone > 0.5)).any()


@pytest.mark.parametrize("place", [0, -1])
def test_a_wild_reading_at_an_end_is_no_friction_that_changes(place: int) -> None:
    plain = record("displacement", 1)
    values = plain.values.copy()
    values[place] += 0.1 * AMPLITUDE
    clean, found = plain_estimate(), fb.estimate(plain.copy(data=values), SYSTEM)
    assert found.decay.stray == pytest.approx((float(plain["time"][place]),))
    assert found.decay.evenly_spaced
    assert found.friction.mean() == pytest.approx(clean.friction.mean(), abs=0.3 * width(clean))
    assert width(found) < 1.1 * width(clean)


def test_a_velocity_at_a_turning_point_may_be_stray() -> None:
    plain = record("velocity", 1)
    turns = np.flatnonzero(np.diff(np.sign(plain.values)))
    values = plain.values.copy()
    values[turns[4]] += 0.3 * AMPLITUDE * UNIT["velocity"]
    found = fb.estimate(plain.copy(data=values), SYSTEM)
    assert found.decay.stray == pytest.approx((float(plain["time"][turns[4]]),))
    assert width(found) < 1.1 * width(plain_estimate("velocity"))


@pytest.mark.parametrize("count", [1, 30])
def test_one_record_and_a_batch_leave_out_the_same(count: int, rng: np.random.Generator) -> None:
    """Many hide each other, as they are in the noise that is found at first."""
    records = [record("displacement", seed) for seed in range(4)]
    places = rng.choice(records[2].size, count, replace=False)
    records[2].values[places] += 0.1 * AMPLITUDE * rng.choice([-1.0, 1.0], count)
    with pytest.warns(fb.RecordWarning, match="set aside: 1"):
        batch = fb.estimate_batch(xr.concat(records, "record"), SYSTEM)
    alone = fb.estimate(records[2], SYSTEM)
    assert len(alone.decay.stray) == count
    assert float(batch["friction_mean"][2]) == pytest.approx(alone.friction.mean(), rel=1e-10)


def test_fewer_samples_than_a_line_takes_are_no_crash() -> None:
    short = record("displacement", 1, sampling_rate=16.0)[:10]
    short.values[8] += 0.5 * AMPLITUDE
    assert fb.estimate(short, SYSTEM).friction.mean() > 0.0


def test_a_short_record_hides_none_from_a_batch() -> None:
    short = [record("displacement", seed, sampling_rate=24.0) for seed in range(2)]
    short[1].values[short[1].size // 2] += 0.3 * AMPLITUDE
    with pytest.warns(fb.RecordWarning, match="set aside: 1"):
        batch = fb.estimate_batch(xr.concat(short, "record"), SYSTEM)
    alone = fb.estimate(short[1], SYSTEM)
    assert len(alone.decay.stray) == 1
    assert float(batch["friction_mean"][1]) == pytest.approx(alone.friction.mean(), rel=1e-10)
