"""A drive at the start is cut where it ends, however few periods follow; one that never ends is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.decay.location import locate_free_decays

FRICTION = 0.25
PERIOD = math.pi / 5.0


def driven_record(periods: float, free: float, *, detuned: float = 1.0, seed: int = 1) -> xr.DataArray:
    """From rest, eight frictions near resonance for some periods, then free for some."""
    step = PERIOD / 2000.0
    count = round((periods + free) * 2000)
    x, v, signal = 0.0, 0.0, []
    for i in range(count):
        t = i * step
        drive = 8.0 * FRICTION * math.sin(10.0 * detuned * t) if t < periods * PERIOD else 0.0
        if i % 20 == 0:
            signal.append(x)
        v += step * (-1000.0 * x - math.copysign(FRICTION, v) + drive) / 10.0
        x += step * v
    noise = 1e-3 * max(signal) * np.random.default_rng(seed).standard_normal(len(signal))
    return fb.make_record(20.0 * step * np.arange(len(signal)), np.array(signal) + noise, "displacement")


@pytest.mark.parametrize("detuned", [0.96, 1.0, 1.04])
@pytest.mark.parametrize(("periods", "free"), [(5.1, 6.0), (9.6, 5.0), (12.3, 12.0)])
def test_the_free_part_is_found(periods: float, free: float, detuned: float, seed: int) -> None:
    record = driven_record(periods, free, detuned=detuned, seed=seed)
    decay = find_free_decay(record, SYSTEM)
    assert decay.driven
    assert periods <= decay.start_time / PERIOD <= periods + 3.5
    assert any("as under a drive" in note for note in decay.notes)


@pytest.mark.parametrize("detuned", [0.96, 1.0])
def test_a_drive_before_three_periods_is_no_friction(detuned: float, seed: int) -> None:
    """A hand that stops the mass leaves as few: but before it amplitude is lost."""
    found = fb.estimate(driven_record(5.1, 3.0, detuned=detuned, seed=seed), SYSTEM)
    assert found.decay.driven
    low, high = found.friction.ppf([0.005, 0.995])
    assert low < FRICTION < high < 2.0 * low


def test_friction_is_that_of_the_free_part(seed: int) -> None:
    found = fb.estimate(driven_record(9.6, 6.0, seed=seed), SYSTEM)
    assert found.friction.mean() == pytest.approx(FRICTION, rel=0.1)


def test_a_drive_that_goes_on_steadily_is_refused(seed: int) -> None:
    time = 0.01 * np.arange(2000)
    swing = np.minimum(time / 6.0, 1.0) * 0.01 * np.sin(10.0 * time)
    noise = 1e-4 * np.random.default_rng(seed).standard_normal(time.size)
    with pytest.raises(fb.InputError, match=r"no loss of amplitude shows.*start"):
        find_free_decay(fb.make_record(time, swing + noise, "displacement"), SYSTEM)


def test_one_record_or_many_are_cut_alike(seed: int) -> None:
    records = [driven_record(9.6, 6.0, detuned=by, seed=seed) for by in (0.96, 1.0, 1.04)]
    together = locate_free_decays(np.stack([each.values for each in records]), PERIOD / 100.0, 10.0, 0)
    starts = [find_free_decay(each, SYSTEM).start_time / (PERIOD / 100.0) for each in records]
    assert together.driven.all()
    np.testing.assert_allclose(together.start, starts, atol=1.0)
