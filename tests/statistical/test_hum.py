"""A strong line of interference is named, and nothing next to it.

Of twelve records with a hum of 20 times the noise none named another effect with more than 10 %; while errors
that neighbours share kept a law out of the mixture, five of twelve named timing jitter. Its prior odds are
1 to 10, and noise says little of it: more than one of six above a half is less likely than 1 in 1,000.
"""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb

SYSTEM = fb.Oscillator(mass=2.0, stiffness=800.0)


def test_nothing_beside_it(seed: int) -> None:
    others = []
    for k in range(4):
        record = fb.simulate(
            SYSTEM,
            friction=0.3,
            initial_displacement=0.02,
            duration=6.0,
            sampling_rate=500.0,
            noise_sd=5e-5,
            seed=seed + k,
        )
        hum = 1e-3 * np.sin(2.0 * np.pi * 47.3 * record["time"].values + 0.4)
        report = fb.close_loop([record.copy(data=record.values + hum)], SYSTEM, seed=1)
        found = {name for c in report.candidates for name in c["effects"]}
        probability = {
            name: sum(c["probability"] for c in report.candidates if name in c["effects"]) for name in found
        }
        assert probability.pop("periodic_interference") > 0.95
        others.append(max(probability.values(), default=0.0))
    assert np.sum(np.array(others) > 0.5) <= 1


def test_several_lines_are_one_effect(seed: int) -> None:
    """Both are in the law along the motion, which then leaves noise."""
    record = fb.simulate(
        SYSTEM,
        friction=0.3,
        initial_displacement=0.02,
        duration=6.0,
        sampling_rate=400.0,
        noise_sd=5e-5,
        seed=seed,
    )
    angle = 2.0 * np.pi * record["time"].values
    hum = 4e-4 * np.sin(50.0 * angle + 0.4) + 2e-4 * np.sin(150.0 * angle)
    report = fb.close_loop([record.copy(data=record.values + hum)], SYSTEM, seed=1)
    assert report.verdict != "unexplained"
    (interference,) = report.effects
    assert interference["name"] == "periodic_interference"
    assert [line["frequency"]["mean"] for line in interference["lines"]] == pytest.approx([50, 150], abs=0.01)
