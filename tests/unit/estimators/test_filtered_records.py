"""Records behind a filter: with gaps, and refused for no saturation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import friction_bayes as fb
from filtered_decays import SYSTEM, decay, filtered
from friction_bayes.core.arrays import Array
from friction_bayes.estimators.result import force_notes


def test_a_gap_takes_away_neither_colours_nor_free_corners() -> None:
    whole, lacking = (fb.estimate(filtered("acceleration", 12.0, lost=lost), SYSTEM) for lost in (0, 28))
    assert lacking.friction.mean() == pytest.approx(whole.friction.mean(), rel=2e-4)
    # not the sd: filters that are not listed, of a probability of 1e-3, are evaluated without gaps alone
    low, high = lacking.friction.interval(0.9)
    assert high - low == pytest.approx(np.diff(whole.friction.interval(0.9))[0], rel=0.1)
    assert lacking.fit.noise_model == "coloured"
    assert lacking.random_force.probability < 0.01


@pytest.mark.parametrize(("rate", "random_force"), [(200.0, "auto"), (1000.0, "none")])
def test_rounded_corners_of_an_acceleration_are_no_saturation(rate: float, random_force: str) -> None:
    """It is refused, or not, before accounts of the noise are compared."""
    found = fb.estimate(filtered("acceleration", 8.0, rate=rate), SYSTEM, random_force=random_force)
    assert found.friction.mean() == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize(
    ("made", "order", "rate"),
    [
        (lambda x, step: np.gradient(x, step), 1, 50.0),
        (lambda x, step: np.diff(x) / step, 1, 50.0),
        (lambda x, step: signal.savgol_filter(x, 9, 2, deriv=1, delta=step), 1, 50.0),
        (lambda x, step: np.gradient(np.gradient(x, step), step), 2, 100.0),
    ],
    ids=["gradient", "differences", "slopes", "gradient twice"],
)
def test_a_derivative_of_positions_is_recognised(
    made: Callable[[Array, float], Array], order: int, rate: float
) -> None:
    """Of 31 positions a period np.gradient shows 1 % less of the motion, slopes over nine samples 10 %."""
    positions = decay(rate=rate)
    derived = made(positions.values, 1.0 / rate)
    inside = slice(10, -10)
    record = fb.make_record(
        positions["time"].values[: derived.size][inside],
        derived[inside],
        ["displacement", "velocity", "acceleration"][order],
    )
    found = fb.estimate(record, SYSTEM)
    assert found.fit.filter is not None
    assert found.fit.filter.name.startswith("a derivative by")
    low, high = found.friction.interval(0.95)
    assert low < 1.0 < high
    assert high - low < 0.01


def test_what_is_silent_above_its_filter_is_no_white_noise() -> None:
    """Noise is then taken to be as strong as near the motion's frequency, and nothing is said against it."""
    found = fb.estimate(filtered("displacement", 16.0, order=4, rate=1000.0, both=True), SYSTEM)
    assert found.fit.noise_model == "coloured"
    assert not any("not white noise" in note for note in found.notes)
    assert found.friction.mean() == pytest.approx(1.0, rel=1e-3)


def test_a_force_next_to_coloured_noise_is_not_doubted_for_residuals_of_its_colour() -> None:
    clean = decay("acceleration", duration=2.8, rate=250.0)
    drawn = np.random.default_rng(4).normal(0.0, 0.06, clean.size)
    noisy = clean.copy(data=clean.values + signal.lfilter([0.44], [1.0, -0.9], drawn))
    found = fb.estimate(noisy, SYSTEM)
    best = max((each for each in found.fit.accounts if each.forced), key=lambda each: each.probability)
    assert best.weaker_above
    assert not best.innovations.white
    likely = replace(found.fit, random_force=replace(found.fit.random_force, probability=0.9))
    notes = force_notes(found.decay, likely)
    assert any("can pass for such a force" in note for note in notes)
    assert not any("not white noise" in note for note in notes)
