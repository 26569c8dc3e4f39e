"""What a user may count on: each effect is evaluated, those that act are found, alone and together."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, long_decay
from friction_bayes.loop.data.prepared_record import cut_records
from friction_bayes.loop.mixture.candidates import Candidates, candidates_of
from loop_options import loop_options

OFFERED = (
    "viscous_damping",
    "quadratic_drag",
    "friction_drift",
    "stribeck_friction",
    "cubic_stiffness",
    "sensor_offset",
    "sensor_drift",
    "periodic_interference",
    "outliers",
    "sensor_clipping",
)
DISSIPATION = frozenset({"viscous_damping", "quadratic_drag", "friction_drift", "stribeck_friction"})


def evaluated(record: xr.DataArray) -> Candidates:
    (segment,) = cut_records([record], SYSTEM)
    return candidates_of((segment,), SYSTEM, loop_options(OFFERED), np.random.default_rng(1))


def test_strong_damping_of_a_record_that_comes_to_rest_is_found() -> None:
    """The Coulomb fit of this record stops early."""
    damping = {"viscous_damping.damping_ratio": 0.003}
    record = long_decay(friction=0.5, duration=33.0, sampling_rate=200.0, seed=1, effects=damping)
    report = fb.close_loop([record], SYSTEM, seed=1)
    assert report.candidates[0]["effects"] == ["viscous_damping"]
    assert ["friction_drift"] in [c["effects"] for c in report.candidates]
    low, high = report.friction_after["interval90"]
    assert low < 0.5 < high


def test_every_single_effect_is_evaluated(seed: int) -> None:
    (fit,) = evaluated(long_decay(seed=seed)).fit.fits
    # a line, outliers and clipped samples are there only where the record shows some
    for name in OFFERED[:7]:
        assert frozenset({name}) in fit.sets, name


@pytest.mark.parametrize(
    "settings",
    [
        {"cubic_stiffness.cubic_stiffness": 4e4, "sensor_offset.offset": 0.003},
        {
            "quadratic_drag.drag_coefficient": 2.0,
            "periodic_interference.amplitude": 0.002,
            "periodic_interference.frequency": 4.1,
        },
        {
            "viscous_damping.damping_ratio": 0.005,
            "sensor_drift.rate": 5e-4,
            "outliers.fraction": 0.03,
            "outliers.scale": 0.01,
        },
    ],
)
def test_combinations_are_found(settings: dict[str, float], seed: int) -> None:
    found = evaluated(long_decay(seed=seed, effects=settings))
    names, best = frozenset(key.partition(".")[0] for key in settings), found.sets[0]
    # one law of dissipation may explain another, but none may be missing
    assert bool(best & DISSIPATION) >= bool(names & DISSIPATION)
    assert best - DISSIPATION == names - DISSIPATION
    # what was planted is a hundred times less probable than the best in fewer than one record in a hundred
    planted = found.probabilities[found.sets.index(names)]
    assert planted > found.probabilities[0] / 100.0


def test_flat_samples_are_censored(seed: int) -> None:
    found = evaluated(long_decay(seed=seed, effects={"sensor_clipping.level": 0.03}))
    assert found.sets[0] == {"sensor_clipping"}
    assert float(np.mean(found.mixture.friction)) == pytest.approx(0.25, rel=0.03)
    assert math.isclose(found.parameters("sensor_clipping")["level"]["mean"], 0.03, rel_tol=0.01)
