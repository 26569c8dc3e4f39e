"""The report as JSON, field by field, of runs that differ in what there is to report."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.signal import lfilter

import friction_bayes as fb
from decays import SYSTEM, short_decay
from fluctuating_force import fluctuating_decay
from friction_bayes.core.files import strict_json
from friction_bayes.mechanics.effects import EFFECTS

FEW = ["viscous_damping", "quadratic_drag", "friction_drift", "random_force", "sensor_offset"]
DRAG = {"quadratic_drag.drag_coefficient": 6.0}


def fluctuating() -> xr.DataArray:
    """Friction of 0.5 N that fluctuates by a fifth, correlated over a sixth of a period."""
    motion = fluctuating_decay(
        np.random.default_rng(4),
        frequency=10.0,
        friction=5e-4,
        release=0.02,
        step=0.01,
        samples=500,
        force_sd=1e-4,
        correlation_time=0.1,
    )[0]
    noise = 1e-5 * np.random.default_rng(5).standard_normal(motion.size)
    return fb.make_record(0.01 * np.arange(motion.size), motion + noise, "displacement", name="fluctuating")


def coloured(record: xr.DataArray) -> xr.DataArray:
    """The same with noise in which two samples that follow each other are alike."""
    kicks = 1e-4 * np.random.default_rng(6).standard_normal(record.size)
    return record.copy(data=record.values + lfilter([1.0], [1.0, -0.7], kicks))


RUNS: dict[str, tuple[list[xr.DataArray], dict[str, Any]]] = {
    "plain": ([short_decay()], {}),
    "drag, autoregressive noise": (
        [coloured(short_decay(noise_sd=2e-5, effects=DRAG))],
        {"noise": "ar", "effects": FEW},
    ),
    "fluctuating force": ([fluctuating()], {"effects": FEW}),
    "two records": (
        [short_decay(seed=2), short_decay(initial_displacement=0.015, seed=3)],
        {"effects": FEW},
    ),
}


def strict(text: str) -> dict[str, Any]:
    """Parse JSON, refusing NaN and infinities."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} in JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module", params=RUNS)
def run(request: pytest.FixtureRequest) -> tuple[str, dict]:
    """Name and report of a run."""
    records, options = RUNS[request.param]
    report = fb.close_loop(records, SYSTEM, seed=3, **options)
    return request.param, strict(strict_json(report.to_dict()))


def is_summary(value: Any, unit: str) -> bool:
    """Whether it is a mean with its sd, an ordered 90 % interval around the mean, and the unit."""
    low, high = value["interval90"]
    ordered = low <= value["mean"] <= high and value["sd"] > 0.0
    return set(value) == {"mean", "sd", "interval90", "unit"} and ordered and value["unit"] == unit


def test_candidates_and_effects(run: tuple[str, dict]) -> None:
    _, report = run
    candidates = report["candidates"]
    probabilities = [candidate["probability"] for candidate in candidates]
    assert math.fsum(probabilities) == pytest.approx(1.0, abs=1e-9)
    assert probabilities == sorted(probabilities, reverse=True)
    sets = [frozenset(candidate["effects"]) for candidate in candidates]
    assert len(set(sets)) == len(sets)
    assert frozenset() in sets
    assert frozenset().union(*sets) <= set(EFFECTS)
    assert [effect["name"] for effect in report["effects"]] == candidates[0]["effects"]
    for effect in report["effects"]:
        own = math.fsum(c["probability"] for c in candidates if effect["name"] in c["effects"])
        assert effect["probability"] == pytest.approx(own, abs=1e-9)
        for parameter in effect["parameters"].values():
            assert {"mean", "sd", "unit"} <= set(parameter)


def test_verdict_follows_its_rules(run: tuple[str, dict]) -> None:
    name, report = run
    best = set(report["candidates"][0]["effects"])
    held = report["candidates"][0]["probability"]
    verdict = report["verdict"]
    assert verdict in ("adequate", "explained", "ambiguous", "unexplained")
    assert (verdict == "unexplained") == bool(report["because"])
    assert verdict != "adequate" or best <= {"random_force"}
    assert verdict != "explained" or not best <= {"random_force"}
    if verdict == "explained":
        assert held >= 0.95
    if verdict == "ambiguous" and best:
        assert held < 0.95 or report["dry_friction"]["probability"] < 0.95
    assert report["next_experiment"] is None or verdict in {"ambiguous", "unexplained"}
    assert report["next_experiment"] is not None or verdict != "unexplained"
    if name == "plain":
        assert verdict == "adequate"


def test_numbers_of_the_record(run: tuple[str, dict]) -> None:
    name, report = run
    assert is_summary(report["friction_before"], "N")
    assert is_summary(report["friction_after"], "N")
    error = report["held_out_error"]
    assert set(error) == {
        "before",
        "after",
        "after_mcse",
        "inside90",
        "noise_floor",
        "unit",
        "what",
    }
    assert error["unit"] == "m"
    assert min(error["before"], error["after"], error["noise_floor"]) > 0.0
    assert 0.0 < error["after_mcse"] < error["after"]
    assert 0.0 <= error["inside90"] <= 1.0
    assert set(report["noise"]) >= {"model", "sd", "correlation_length_s"}
    assert report["noise"]["model"] == ("ar" if name == "drag, autoregressive noise" else "white")
    assert set(report["residual"]) == {"before", "after"}
    assert set(report["paper_procedure"]) >= {"friction", "disagrees", "because"}
    assert report["reference_check"] is None
    assert report["elapsed_s"] > 0.0


def test_random_force(run: tuple[str, dict]) -> None:
    name, report = run
    force = report["random_force"]
    if name == "drag, autoregressive noise":
        assert force is None or force["probability"] < 0.2
    if force is None:
        return
    assert set(force) == {"sd", "share_of_friction", "correlation_time_s", "probability"}
    assert is_summary(force["sd"], "N")
    assert is_summary(force["correlation_time_s"], "s")
    own = math.fsum(c["probability"] for c in report["candidates"] if "random_force" in c["effects"])
    assert force["probability"] == pytest.approx(own, abs=1e-9)
    if name == "fluctuating force":
        assert force["probability"] > 0.95


def test_what_is_left(run: tuple[str, dict]) -> None:
    _, report = run
    left = report["left"]
    assert set(left) == {
        "record",
        "structured_rms",
        "unit",
        "share_of_amplitude",
        "friction_could_shift_by",
        "depends_on",
        "shape",
        "share",
    }
    assert left["depends_on"] in (None, "velocity", "position", "amplitude", "time")
    assert (left["shape"] is None) == (left["share"] is None) == (left["depends_on"] is None)
    assert left["structured_rms"] >= 0.0


def test_what_was_fitted(run: tuple[str, dict]) -> None:
    _, report = run
    fitted = report["fitted"]
    assert set(fitted) == {"from_s", "to_s", "samples", "half_cycles", "set_aside"}
    assert 0.0 <= fitted["from_s"] < fitted["to_s"] <= 5.0
    assert fitted["samples"] >= fitted["half_cycles"] > 4
    assert fitted["set_aside"] == 0
