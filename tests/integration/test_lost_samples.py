"""A record in which some tenths of a second are missing says what the whole one does."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)
NOISE = {"displacement": 3e-5, "velocity": 2e-3, "acceleration": 2e-2}


def record(quantity: str, rate: float, *lost: float, periods: float = 0.2) -> xr.DataArray:
    """Without so many periods after each of some times [s]."""
    whole = fb.simulate(
        SYSTEM,
        friction=0.07,
        initial_displacement=0.0147,
        duration=12.0,
        sampling_rate=rate,
        noise_sd=NOISE[quantity],
        seed=5,
        quantity=quantity,
    )
    time = whole["time"].values
    kept = np.ones(time.size, dtype=bool)
    for start in lost:
        kept &= (time < start) | (time > start + periods * 0.625)
    return fb.make_record(time[kept], whole.values[kept], quantity)


@cache
def answers(
    quantity: str, rate: float, *lost: float, periods: float = 0.2
) -> tuple[fb.Estimate, fb.LoopReport]:
    """Of the estimate and of the loop; those of a whole record serve with gaps of any length."""
    given = record(quantity, rate, *lost, periods=periods)
    return fb.estimate(given, SYSTEM), fb.close_loop([given], SYSTEM, seed=1, check=False)


@pytest.mark.parametrize(
    ("quantity", "rate", "periods"),
    [
        ("displacement", 100.0, 0.9),
        ("velocity", 2000.0, 0.2),
        ("acceleration", 100.0, 0.2),
    ],
)
def test_gaps_cost_what_the_samples_would_have_shown(quantity: str, rate: float, periods: float) -> None:
    """At 2000 Hz values are means of six samples, some of them from both sides of a gap."""
    whole, lacking = (
        answers(quantity, rate),
        answers(quantity, rate, 1.571, 3.333, 7.0, 11.1, periods=periods),
    )
    before, after = whole[0].friction, lacking[0].friction
    assert after.mean() == pytest.approx(before.mean(), abs=before.std())
    # a random force of some per cent of probability widens one of the two
    assert 0.5 < after.std() / before.std() < 2.0
    reports = [whole[1], lacking[1]]
    assert [report.verdict for report in reports] == ["adequate", "adequate"]
    assert reports[1].residual["after"]["failed"] == []
    (low, high), (low_whole, high_whole) = (report.friction_after["interval90"] for report in reports[::-1])
    assert low < 0.07 < high
    # and a slight force or damping of one in five either of these
    assert 0.4 < (high - low) / (high_whole - low_whole) < 2.5
