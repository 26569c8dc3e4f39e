"""Friction drawn anew for each release: its mean, its spread and each release's own are recovered."""

from __future__ import annotations

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM, slow_decay

MEAN, EFFECTS = 0.07, ["viscous_damping", "random_force"]


@pytest.mark.parametrize("spread", [0.03, 0.1])
def test_mean_and_spread_of_eight_releases(spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    frictions = MEAN * (1.0 + spread * rng.standard_normal(8))
    records = [
        slow_decay(friction=friction, duration=10.0, sampling_rate=100.0, seed=seed + k)
        for k, friction in enumerate(frictions)
    ]
    report = fb.close_loop(records, SYSTEM, seed=1, effects=EFFECTS, varying_friction=True)
    between = report.friction_between_records
    assert between is not None
    # what eight releases say of their distribution: sd of the mean and of the logarithm of the spread
    assert abs(report.friction_after["mean"] - MEAN) < 4.0 * spread * MEAN / np.sqrt(8)
    assert np.log(between["share_of_friction"] / spread) == pytest.approx(0.0, abs=4.0 / np.sqrt(14))
    z = [
        (record["friction"]["mean"] - truth) / record["friction"]["sd"]
        for record, truth in zip(between["records"], frictions, strict=True)
    ]
    assert np.sum(np.square(z)) < 26.1, "chi-square of eight beyond its 0.1 % point"
