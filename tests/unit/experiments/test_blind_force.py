from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments import loop_blind_force
from experiments.blind.fluctuating import draw_fluctuating
from experiments.blind.force_scoring import force_score, other_effects, without_force
from experiments.blind.generator import KINDS, draw
from experiments.blind.sealed import Truth
from friction_bayes.mechanics.effects.inclusion import prior_log_odds

TRUTH = draw_fluctuating("quadratic_drag", 3).truth


def report(truth: Truth, *, friction: float = 1.0, width: float = 0.1, sd: float = 1.0) -> dict[str, Any]:
    """A report of a record with drag; lengths in units of the truth."""
    mean = friction * truth.friction
    summary = {"mean": mean, "sd": width * mean / 3.3, "unit": "N"}
    summary["interval90"] = [mean * (1.0 - width / 2.0), mean * (1.0 + width / 2.0)]
    force, time = (truth.parameters[name] for name in ("force_sd", "correlation_time_s"))
    return {
        "verdict": "explained",
        "candidates": [
            {"effects": ["quadratic_drag", "random_force"], "probability": 0.5},
            {"effects": ["quadratic_drag"], "probability": 0.25},
            {"effects": ["random_force"], "probability": 0.2},
            {"effects": [], "probability": 0.05},
        ],
        "friction_before": summary,
        "friction_after": summary,
        "random_force": {
            "sd": {"mean": sd * force, "interval90": [0.9 * sd * force, 1.1 * sd * force]},
            "correlation_time_s": {"mean": time, "interval90": [0.5 * time, 2.0 * time]},
        },
        "held_out_error": {"inside90": 0.88},
    }


def test_sets_with_and_without_a_force_are_one_set_of_other_effects() -> None:
    collapsed = {tuple(c["effects"]): c["probability"] for c in without_force(report(TRUTH))}
    assert collapsed == {("quadratic_drag",): pytest.approx(0.75), (): pytest.approx(0.25)}
    assert other_effects(TRUTH) == ("quadratic_drag",)


def test_a_right_report_scores() -> None:
    scored = force_score(TRUTH, report(TRUTH))
    assert scored["right"]
    assert scored["held"]
    assert scored["covered"]
    assert scored["force_probability"] == pytest.approx(0.7)
    assert scored["force_sd_covered"] == scored["correlation_time_covered"] == 1.0
    assert scored["force_sd_error"] == pytest.approx(0.0)
    assert scored["band"] == 0.88
    assert scored["widths_off"] == 0.0


def test_a_wrong_report_scores_against() -> None:
    scored = force_score(TRUTH, report(TRUTH, friction=1.25, sd=1.5))
    assert not scored["covered"]
    assert scored["force_sd_covered"] == 0.0
    # a quarter of friction off, and an interval a tenth of 1.25 wide
    assert scored["widths_off"] == pytest.approx(2.0)


def test_a_report_without_a_force_tells_nothing_of_its_size() -> None:
    scored = force_score(TRUTH, report(TRUTH) | {"random_force": None})
    assert math.isnan(scored["force_sd_covered"])
    still = draw_fluctuating("backlash", 3, with_force=False).truth
    assert math.isnan(force_score(still, report(TRUTH))["force_sd_covered"])


def test_cells_and_tables_of_a_run(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    handed: list[Any] = []

    def oracle(
        records: list[xr.DataArray], system: fb.Oscillator, *, seed: int, random_force: str, check: bool
    ) -> SimpleNamespace:
        handed.append((records, system, random_force))
        if len(handed) > 4:
            raise fb.InputError("sealed record", "unusable", "none")
        said = report(TRUTH) | ({} if random_force == "auto" else {"random_force": None})
        return SimpleNamespace(to_dict=lambda: said)

    monkeypatch.setattr(fb, "close_loop", oracle, raising=False)
    cells = [
        {"kind": "quadratic_drag", "fluctuates": True, "replicate": 0},
        {"kind": "rough_patch", "fluctuates": True, "replicate": 0},
        {"kind": "backlash", "fluctuates": False, "replicate": 0},
    ]
    assert all(cell in loop_blind_force.cells(loop_blind_force.Config(), False) for cell in cells)
    results = [
        loop_blind_force.run(loop_blind_force.Config(), c, np.random.SeedSequence(seed)) for c in cells
    ]
    assert [choice for _, _, choice in handed] == ["none", "auto"] * 3
    assert [result["after_held"] for result in results] == [True, False, False]
    assert [result["after_verdict"] for result in results] == ["explained", "explained", "refused"]
    dataset = loop_blind_force.assemble(cells, results)
    table = {row.what: row for row in loop_blind_force.rows(dataset)}
    assert table["true set of other effects among those that add up to 95 %"].ours.startswith("100")
    assert table["outside the catalogue: called unexplained"].ours.startswith("0 ")
    assert table["refused"].ours.startswith("33")
    kinds = loop_blind_force.EXPERIMENT.details
    assert kinds is not None
    assert [line["kind"] for line in kinds(dataset)] == [
        "quadratic drag",
        "rough patch",
        "backlash, no force",
    ]


def test_full_run_extends_the_default_one() -> None:
    config = loop_blind_force.Config()
    default, full = loop_blind_force.cells(config, False), loop_blind_force.cells(config, True)
    assert all(cell in full for cell in default)
    assert 200 <= len(default) <= 240


def test_a_rough_patch_is_no_fluctuation() -> None:
    """A random force takes up most of what it does to the motion, not that it stays where it is.

    Friction that changes along a curve, one term more than a straight drift, would explain that.
    """
    sealed = draw("rough_patch", np.random.SeedSequence([20261121, KINDS.index("rough_patch"), 0]))
    found = fb.close_loop(
        [sealed.record],
        fb.Oscillator(**sealed.system),
        seed=0,
        effects=["viscous_damping", "friction_drift", "position_friction", "presliding", "random_force"],
    )
    assert found.verdict not in ("adequate", "explained")
    by_position = [c["probability"] for c in found.candidates if "position_friction" in c["effects"]]
    odds = sum(by_position) / (1.0 - sum(by_position))
    assert odds > 9.0 * math.exp(prior_log_odds())


def test_a_stop_on_one_side_is_no_fluctuation() -> None:
    """A cubic spring and a random force take up most of it; a test of all positions at once sees half."""
    seed = np.random.SeedSequence([20261121, KINDS.index("one_sided_spring"), 11])
    sealed = draw("one_sided_spring", seed)
    found = fb.close_loop([sealed.record], fb.Oscillator(**sealed.system), seed=0, check=False)
    failed = found.residual["after"]["failed"]
    assert found.verdict == "unexplained"
    assert found.left["depends_on"] == "position"
    assert "force_by_stop" in failed
    assert "force_by_position" not in failed
