"""Verdict, next experiment, forecast, force and the report's fields."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from arviz_stats.base import array_stats

import friction_bayes as fb
from decays import SYSTEM, long_decay, slow_decay
from friction_bayes.loop import LoopReport
from friction_bayes.loop.build_report import reasons_against
from friction_bayes.loop.report.next_experiment import WHETHER_IT_RUBS
from friction_bayes.loop.report.verdict import credible_count, verdict
from friction_bayes.mechanics.integrate import integrate

NONE: frozenset[str] = frozenset()
VISCOUS = frozenset({"viscous_damping"})
DRIFT = frozenset({"friction_drift"})
FORCE = frozenset({"random_force"})
JITTER = frozenset({"timing_jitter"})
OFFSET = frozenset({"sensor_offset"})


@pytest.fixture(scope="module")
def ambiguous() -> LoopReport:
    record = long_decay(seed=5, effects={"viscous_damping.damping_ratio": 0.002})
    return fb.close_loop([record], SYSTEM, seed=3, effects=["viscous_damping", "friction_drift"])


@pytest.mark.parametrize(
    ("sets", "probabilities", "word"),
    [
        ([NONE, VISCOUS], [0.96, 0.04], "adequate"),
        ([NONE, VISCOUS], [0.6, 0.4], "ambiguous"),
        ([NONE, DRIFT], [0.6, 0.4], "adequate"),
        ([NONE, VISCOUS, DRIFT], [0.6, 0.06, 0.34], "ambiguous"),
        ([FORCE, NONE, DRIFT], [0.6, 0.06, 0.34], "adequate"),
        ([FORCE, VISCOUS | FORCE], [0.9, 0.1], "ambiguous"),
        ([VISCOUS, DRIFT], [0.96, 0.04], "explained"),
        ([VISCOUS, DRIFT], [0.94, 0.06], "ambiguous"),
        ([VISCOUS, VISCOUS | FORCE], [0.94, 0.06], "ambiguous"),
        ([VISCOUS | FORCE, VISCOUS], [0.96, 0.04], "explained"),
        ([VISCOUS, DRIFT | FORCE], [0.9, 0.1], "ambiguous"),
        ([OFFSET, OFFSET | DRIFT], [0.91, 0.09], "adequate"),
        ([OFFSET | FORCE, OFFSET | DRIFT], [0.91, 0.09], "adequate"),
        ([OFFSET, OFFSET | VISCOUS], [0.91, 0.09], "ambiguous"),
        ([OFFSET, OFFSET | VISCOUS], [0.96, 0.04], "explained"),
        ([OFFSET | DRIFT, OFFSET], [0.91, 0.09], "ambiguous"),
        ([frozenset({"sensor_nonlinearity"}), DRIFT], [0.91, 0.09], "ambiguous"),
        ([JITTER | OFFSET, OFFSET], [0.8, 0.2], "adequate"),
        ([JITTER, NONE], [0.96, 0.04], "explained"),
    ],
)
def test_verdict_follows_the_rule(sets: list[frozenset[str]], probabilities: list[float], word: str) -> None:
    agrees = np.array([not names & VISCOUS for names in sets])
    assert verdict(sets, np.array(probabilities), agrees, (), 0.99) == word
    # whether dry friction acts is part of a law; effects may explain a record without it
    assert verdict(sets, np.array(probabilities), agrees, (), 0.9) == "ambiguous"
    without = "explained" if word == "explained" else "ambiguous"
    assert verdict(sets, np.array(probabilities), agrees, (), 0.04) == without
    assert verdict(sets, np.array(probabilities), agrees, ("band",), 0.99) == "unexplained"
    assert verdict(sets, np.array(probabilities), agrees, ("forecast", "band"), 0.99) == "unexplained"
    assert verdict(sets, np.array(probabilities), agrees, ("forecast",), 0.99) == "ambiguous"


SOUND: dict[str, Any] = {
    "explains": True,
    "factor": 1.0,
    "shift": 0.1,
    "loss": 1.0,
    "held_out": {"before": 2.0, "after": 2.0, "inside90": 0.9, "noise_floor": 0.1},
    "least_noise": 0.0,
    "witnesses": None,
    "contradicted": False,
}


def heard(loss: float, shape: float, *, agree: bool) -> dict[str, Any]:
    """Two witnesses, each known to within a tenth."""
    both = {"loss": loss, "shape": shape}
    return {name: {"interval90": [mean - 0.1, mean + 0.1]} for name, mean in both.items()} | {"agree": agree}


def forecast(**figures: float) -> dict[str, Any]:
    return {"held_out": SOUND["held_out"] | figures}


@pytest.mark.parametrize(
    ("found", "against"),
    [
        ({}, ()),
        ({"explains": False}, ("left_over",)),
        ({"shift": 0.49}, ()),
        ({"shift": 0.51}, ("shift",)),
        # a motion that loses no amplitude has no friction that what is left could be half of
        ({"shift": 0.51, "loss": 0.0}, ()),
        (forecast(inside90=0.76), ()),
        (forecast(inside90=0.74), ("band",)),
        (forecast(after=2.09), ()),
        (forecast(after=2.11), ("forecast",)),
        (forecast(before=math.nan, after=math.nan, inside90=math.nan), ()),
        ({"witnesses": heard(1.0, 3.0, agree=True)}, ()),
        ({"witnesses": heard(1.0, 1.19, agree=False)}, ()),
        ({"witnesses": heard(1.0, -0.5, agree=False)}, ("witnesses",)),
        ({"witnesses": heard(1.3, 1.0, agree=False)}, ("witnesses",)),
        ({"contradicted": True}, ("records",)),
        (forecast(after=3.0, inside90=0.35) | {"contradicted": True}, ("band", "forecast", "records")),
    ],
)
def test_what_forbids_to_use_the_number(found: dict[str, Any], against: tuple[str, ...]) -> None:
    candidates = SimpleNamespace(**SOUND | found)
    assert reasons_against(candidates, candidates.loss, candidates.held_out, (0.9, 1.1)) == against


def test_credible_counts_what_holds_95_percent() -> None:
    assert credible_count(np.array([0.96, 0.04])) == 1
    assert credible_count(np.array([0.6, 0.3, 0.06, 0.04])) == 3


def test_a_tie_names_both_and_what_would_decide(ambiguous: LoopReport) -> None:
    assert ambiguous.verdict == "ambiguous"
    sentence = ambiguous.next_experiment
    assert sentence is not None
    # damping follows the amplitude and drift the time: another release parts them, a longer record does not
    assert sentence.startswith("Add a record released from half the amplitude")
    assert "viscous damping" in sentence
    assert "friction drift" in sentence
    assert "more than 1e5" in sentence


def test_a_law_with_or_without_dry_friction_explains_nothing_yet() -> None:
    """Friction is a fifth of the loss, which is the tolerance: this record cannot say whether it is more."""
    record = long_decay(seed=2, friction=0.14, effects={"viscous_damping.damping_ratio": 0.03})
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["viscous_damping"])
    assert report.candidates[0]["probability"] > 0.95
    assert 0.05 < report.dry_friction["probability"] < 0.95
    assert report.verdict == "ambiguous"
    assert report.next_experiment == WHETHER_IT_RUBS


def test_probabilities_sum_to_one_and_friction_is_averaged(ambiguous: LoopReport) -> None:
    assert sum(c["probability"] for c in ambiguous.candidates) == pytest.approx(1.0)
    which = ambiguous.posterior["mixture"]["candidate"].values
    assert len(np.unique(which)) > 1
    # in no order: draws that are independent are read as such
    assert array_stats.ess(which.astype(float), chain_axis=0, draw_axis=1) > 0.5 * which.size
    single = ambiguous.posterior["posterior"]["friction"].values
    assert ambiguous.friction_after["sd"] > 1.2 * single.std()


def test_the_same_seed_gives_the_same_report(ambiguous: LoopReport) -> None:
    record = long_decay(seed=5, effects={"viscous_damping.damping_ratio": 0.002})
    again = fb.close_loop([record], SYSTEM, seed=3, effects=["viscous_damping", "friction_drift"])
    first, second = ambiguous.to_dict(), again.to_dict()
    assert first.pop("elapsed_s") > 0.0
    second.pop("elapsed_s")
    assert first == second


def test_report_is_strict_json(ambiguous: LoopReport) -> None:
    text = json.dumps(ambiguous.to_dict(), allow_nan=False)
    assert json.loads(text)["verdict"] == "ambiguous"


def test_a_coulomb_record_is_adequate_and_forecast_to_the_noise() -> None:
    # a record of its own: of one in twenty the verdict may be another
    report = fb.close_loop([long_decay(seed=4)], SYSTEM, seed=1)
    assert report.verdict == "adequate"
    assert report.candidates[0]["probability"] > 0.5
    held_out = report.held_out_error
    # forecast over 216 samples: 5 % standard error of the noise
    assert held_out["after"] == pytest.approx(5e-4, rel=0.3)
    assert held_out["noise_floor"] == pytest.approx(5e-4, rel=0.2)


def test_held_samples_measure_no_noise(seed: int) -> None:
    record = long_decay(seed=seed, effects={"sensor_clipping.level": 0.03})
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["sensor_clipping"], noise="white")
    fields = report.to_dict()
    # some five hundred free samples: 3 % standard error of the noise
    for sd in (
        fields["noise"]["sd"],
        fields["held_out_error"]["noise_floor"],
        fields["residual"]["after"]["rms"],
    ):
        assert sd == pytest.approx(5e-4, rel=0.2)


def test_friction_has_no_range_where_a_law_explains_the_record(seed: int) -> None:
    report = fb.close_loop([long_decay(seed=seed)], SYSTEM, seed=1, effects=["viscous_damping"])
    assert report.verdict != "unexplained"
    assert report.friction_range is None


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_a_record_without_noise_is_adequate(quantity: str) -> None:
    """What rounding leaves of an acceleration is far from white, and no autoregression describes it."""
    record = slow_decay(duration=12.0, sampling_rate=100.0, noise_sd=0.0, quantity=quantity)
    offered = ["viscous_damping", "friction_drift", "sensor_offset", "random_force", "outliers"]
    report = fb.close_loop([record], SYSTEM, seed=1, effects=offered)
    assert report.noise["order"] == 0
    assert report.verdict == "adequate"
    assert report.friction_after["mean"] == pytest.approx(0.07, rel=1e-4)


def test_the_missing_effect_shows_in_the_forecast(seed: int) -> None:
    record = long_decay(seed=seed, effects={"cubic_stiffness.cubic_stiffness": 6e4})
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["cubic_stiffness", "viscous_damping"])
    assert report.candidates[0]["effects"] == ["cubic_stiffness"]
    assert report.held_out_error["after"] < 0.3 * report.held_out_error["before"]
    assert report.residual["before"]["failed"]
    parameter = report.effects[0]["parameters"]["cubic_stiffness"]
    assert parameter["mean"] == pytest.approx(6e4, abs=5.0 * parameter["sd"])
    assert parameter["unit"] == "N/m3"


def test_what_no_effect_explains_is_not_dressed_up(seed: int) -> None:
    """A second mode near the first that dies away: no such effect is offered."""
    record = long_decay(seed=seed)
    time = record["time"].values
    mode = 0.004 * np.exp(-time / 2.0) * np.cos(14.0 * time)
    report = fb.close_loop(
        [record + mode], SYSTEM, seed=1, effects=["viscous_damping", "periodic_interference"]
    )
    assert report.verdict == "unexplained"
    assert report.next_experiment is not None
    assert "at rest with the same sensor" in report.next_experiment
    readings = report.friction_range
    assert readings is not None
    assert readings["readings"][0]["what"] == "Coulomb friction alone"
    means = [reading["mean"] for reading in readings["readings"]]
    assert (readings["low"], readings["high"]) == (min(means), max(means))
    low, high = report.friction_after["interval90"]
    assert low < 0.25 < high


def test_a_measured_force_is_set_beside_both_models(seed: int) -> None:
    settings = {"viscous_damping.damping_ratio": 0.006}
    record = long_decay(seed=seed, effects=settings)
    motion = integrate(SYSTEM, 0.25, 0.05, 0.0, record["time"].values, settings)
    force = -(SYSTEM.moving * motion.acceleration + SYSTEM.stiffness * motion.displacement)
    # a cell on the other side of the contact shows the opposite sign
    report = fb.close_loop([record], SYSTEM, seed=1, effects=["viscous_damping"], reference_force=-force)
    force_error = report.residual["force"]
    assert force_error["unit"] == "N"
    assert force_error["after"] < 0.3 * force_error["before"]
    forces = report.traces[0].forces
    assert forces is not None
    # at a turning point the sign depends on the last digit of the phase
    assert np.median(np.abs(forces[2] - force[: forces[2].size])) < 0.01
    with pytest.raises(fb.InputError, match="reference_force"):
        fb.close_loop([record], SYSTEM, seed=1, reference_force=force[:-1])


def test_a_reference_friction_is_compared_with(seed: int) -> None:
    report = fb.close_loop(
        [long_decay(seed=seed)], SYSTEM, seed=1, effects=["sensor_offset"], reference_friction=0.25
    )
    check = report.reference_check
    assert check is not None
    assert abs(check["error_after"]) < 0.05


@pytest.mark.parametrize(
    ("options", "place"),
    [
        ({"noise": "pink"}, "noise"),
        ({"effects": ["wear"]}, "wear"),
        ({"reference_friction": -1.0}, "reference_friction"),
    ],
)
def test_wrong_options_are_named(options: dict[str, Any], place: str) -> None:
    with pytest.raises(fb.InputError, match=place):
        fb.close_loop([long_decay(seed=1)], SYSTEM, seed=1, **options)


@pytest.mark.parametrize("amplitudes", [3.0, 340.0])
def test_a_zero_far_off_is_no_misfit_of_the_law(amplitudes: float) -> None:
    """Friction is what `estimate` finds, before and after, and the forecast gains nothing."""
    record = long_decay(seed=4)
    moved = record.copy(data=record.values + 0.05 * amplitudes)
    estimate = fb.estimate(record, SYSTEM).friction
    report = fb.close_loop([moved], SYSTEM, seed=1, effects=["sensor_offset", "cubic_stiffness"])
    assert report.candidates[0]["effects"] == ["sensor_offset"]
    for friction in (report.friction_before, report.friction_after):
        assert friction["mean"] == pytest.approx(estimate.mean(), abs=0.5 * estimate.std())
    error = report.held_out_error
    assert error["before"] == pytest.approx(error["after"], rel=0.05)
    empty = next(c for c in report.candidates if not c["effects"])
    assert empty["probability"] < 1e-6


@pytest.mark.parametrize(("failed", "word"), [(0, "explained"), (1, "explained"), (2, "ambiguous")])
def test_no_law_explains_a_record_that_fails_two_tests(failed: int, word: str) -> None:
    sets = [frozenset({"viscous_damping"}), frozenset[str]()]
    agrees = np.array([True, False])
    assert verdict(sets, np.array([0.98, 0.02]), agrees, (), 0.99, failed) == word
