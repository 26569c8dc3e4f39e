"""Runs of one value that the motion cannot have, and what must not be taken for them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from friction_bayes.core.errors import RecordWarning
from friction_bayes.decay.dropouts import without_dropouts
from tests.decays import SYSTEM, written_decay

RATE, SHIFT, NOISE = 100.0, 5e-4, 5e-5
ANGLE = SYSTEM.natural_frequency / RATE
TIME = np.arange(1200) / RATE
CLEAN = np.where(2.0 * np.pi > TIME, written_decay(TIME, 0.0202, SHIFT), 2e-4)
RUNS = {"zero": (100, 4, 0.0), "last": (221, 9, None), "rail": (310, 15, 0.04), "two": (404, 2, -0.02)}


def noisy(rng: np.random.Generator) -> np.ndarray:
    return CLEAN + NOISE * rng.normal(size=CLEAN.size)


def with_runs(values: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Dropouts to several values, and the samples at them."""
    at: list[int] = []
    values = values.copy()
    for first, length, level in RUNS.values():
        values[first : first + length] = values[first - 1] if level is None else level
        # the reading that is held is the first of those alike
        at += range(first - (level is None), first + length)
    return values, at


def record(values: np.ndarray) -> xr.DataArray:
    return fb.make_record(TIME, values, "displacement", name="run")


@pytest.mark.parametrize("step", [0.0, 1e-3])
def test_runs_of_one_value_far_from_the_motion_are_found(rng: np.random.Generator, step: float) -> None:
    """By an encoder of one step a millimetre many other neighbours are equal."""
    values = noisy(rng)
    wrong, at = with_runs(np.floor(values / step) * step if step else values)
    mended, dropouts = without_dropouts(wrong, ANGLE)
    # by a coarse one the value before the last that is held may be the same
    assert set(at) <= set(dropouts.tolist()) <= {*at, *(i - 1 for i in at)}
    # friction changes its side where one hides a turning point
    assert np.abs(mended - CLEAN)[at].max() < SHIFT + step


@pytest.mark.parametrize("periods", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("level", [0.0, 0.007])
def test_longer_ones_are_found_too(rng: np.random.Generator, level: float, periods: float) -> None:
    """Up to a period, by a frequency declared too high by a twentieth."""
    wrong, first, length = noisy(rng), 111, round(periods * 2.0 * np.pi / ANGLE)
    wrong[first : first + length] = level
    mended, dropouts = without_dropouts(wrong, 1.05 * ANGLE)
    assert dropouts.tolist() == list(range(first, first + length))
    # where two turning points are hidden friction is felt twice
    assert np.abs(mended - CLEAN).max() < 4.0 * SHIFT


def pulled_and_held(values: np.ndarray) -> np.ndarray:
    """Caught in the hand in mid-motion, pulled, held for a third of a period, and released again."""
    held, pulled = values[250], 0.01 * np.sin(np.linspace(0.0, 0.5 * np.pi, 12)) ** 2
    again = written_decay(TIME, held + 0.01, SHIFT)
    return np.concatenate([values[:250], held + pulled, np.full(20, held + 0.01), again])


def clipped(values: np.ndarray) -> np.ndarray:
    return np.clip(values, -0.012, 0.015)


def encoder(values: np.ndarray) -> np.ndarray:
    return np.floor(values / 1e-3) * 1e-3


def loose(values: np.ndarray) -> np.ndarray:
    """Backlash: the reading stays where the motion turns."""
    out, reading = np.empty_like(values), values[0]
    for i, value in enumerate(values):
        out[i] = reading = min(max(reading, value - 1e-3), value + 1e-3)
    return out


def slipped(values: np.ndarray) -> np.ndarray:
    """A sensor that has slipped, and shows steps on either side of it."""
    return encoder(values + np.where(TIME > 3.0, 6e-3, 0.0))


@pytest.mark.parametrize("sensor", [np.array, clipped, encoder, loose, slipped, pulled_and_held])
def test_nothing_else_is_taken_for_one(
    rng: np.random.Generator, sensor: Callable[[np.ndarray], np.ndarray]
) -> None:
    for _ in range(20):
        for values in (CLEAN, noisy(rng)):
            assert without_dropouts(sensor(values), ANGLE)[1].size == 0


def test_they_cost_what_they_would_have_shown(rng: np.random.Generator) -> None:
    values = noisy(rng)
    wrong, at = with_runs(values)
    whole = fb.estimate(record(values), SYSTEM)
    with pytest.warns(RecordWarning, match=r"^run: 31 samples in 4 runs of one value each, .* sample 101 "):
        lacking = fb.estimate(record(wrong), SYSTEM)
    assert lacking.decay.stray == pytest.approx(TIME[at])
    assert lacking.friction.mean() == pytest.approx(whole.friction.mean(), abs=whole.friction.std())
    widths = [float(np.diff(found.friction.interval(0.9))[0]) for found in (whole, lacking)]
    assert widths[1] == pytest.approx(widths[0], rel=0.2)


def test_in_a_batch_the_answer_is_the_same(rng: np.random.Generator) -> None:
    values = noisy(rng)
    wrong, _ = with_runs(values)
    with pytest.warns(RecordWarning, match="1 of 2 records have warnings"):
        batch = fb.estimate_batch(
            np.array([values, wrong]), SYSTEM, sampling_rate=RATE, quantity="displacement"
        )
    with pytest.warns(RecordWarning, match="4 runs"):
        alone = fb.estimate(record(wrong), SYSTEM)
    assert batch["friction_mean"].values[1] == pytest.approx(alone.friction.mean(), rel=1e-9)
    assert batch["friction_interval90"].values[1] == pytest.approx(alone.friction.interval(0.9), rel=1e-9)


def test_the_loop_does_not_fit_them(rng: np.random.Generator) -> None:
    wrong, _ = with_runs(noisy(rng))
    with pytest.warns(RecordWarning, match="4 runs"):
        report = fb.close_loop([record(wrong)], SYSTEM, seed=1, check=False)
    low, high = report.friction_after["interval90"]
    assert report.verdict == "adequate"
    assert low < SHIFT * SYSTEM.stiffness < high
    assert high - low < 0.02 * high


def test_a_real_leap_is_still_refused(rng: np.random.Generator) -> None:
    wrong, _ = with_runs(noisy(rng))
    with (
        pytest.warns(RecordWarning, match="4 runs"),
        pytest.raises(fb.InputError, match=r"leaps by 0\.006.* at 6\.99 s"),
    ):
        fb.estimate(record(wrong + np.where(TIME > 6.995, 6e-3, 0.0)), SYSTEM)
