"""Friction next to a viscous damping that a record cannot show.

The damping ratio is 1.3 standard deviations of its estimate from the record, about where it is most easily
missed: of 85 other records the interval covers 46, and without slight effects one in five. That fewer than
four of fourteen are covered has a probability of 1.4 %.
"""

from __future__ import annotations

import numpy as np

import friction_bayes as fb
from curtailed import at_least
from decays import SYSTEM, slow_decay


def _covers(seed: int) -> bool:
    record = slow_decay(effects={"viscous_damping.damping_ratio": 2e-4}, seed=seed)
    low, high = fb.close_loop([record], SYSTEM, seed=seed, random_force="none").friction_after["interval90"]
    return bool(low <= 0.07 <= high)


def test_friction_is_covered_beside_damping_that_does_not_show() -> None:
    assert at_least(4, (_covers(seed) for seed in range(4200, 4214)))


def test_the_interval_counts_what_does_not_show() -> None:
    record = slow_decay(effects={"viscous_damping.damping_ratio": 2e-4}, seed=4200)
    widths = [
        float(
            np.ptp(
                fb.close_loop([record], SYSTEM, random_force="none", exclude=each).friction_after[
                    "interval90"
                ]
            )
        )
        for each in ((), ("viscous_damping", "friction_drift", "curved_friction_drift"))
    ]
    assert widths[0] > 2.0 * widths[1]
