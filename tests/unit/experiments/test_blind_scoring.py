from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from experiments import loop_blind
from experiments.blind.figures_of_merit import (
    common_traits,
    figures_of_merit,
    median_error,
    rate_error,
    reliability,
)
from experiments.blind.scoring import credible_set, score, set_name


def report(
    *candidates: tuple[list[str], float], mean: float = 1.0, verdict: str = "explained"
) -> dict[str, Any]:
    friction = {"mean": mean, "sd": 0.01, "interval90": [mean - 0.02, mean + 0.02], "unit": "N"}
    return {
        "verdict": verdict,
        "candidates": [{"effects": names, "probability": p} for names, p in candidates],
        "friction_before": friction | {"mean": 1.3},
        "friction_after": friction,
    }


def test_credible_set_is_the_smallest_that_holds_the_mass() -> None:
    candidates = report((["b"], 0.3), ([], 0.6), (["c"], 0.06), (["d"], 0.04))["candidates"]
    assert credible_set(candidates) == ["none", "b", "c"]
    assert credible_set(candidates, 0.6) == ["none"]


def test_a_right_answer_scores() -> None:
    scored = score(
        ("quadratic_drag", "sensor_offset"),
        1.01,
        report((["sensor_offset", "quadratic_drag"], 0.9), ([], 0.1)),
    )
    assert scored["right"]
    assert scored["held"]
    assert scored["covered"]
    assert scored["truth_rank"] == 0
    assert scored["truth_probability"] == 0.9
    assert scored["error_after"] == pytest.approx(0.01 / 1.01)
    assert scored["error_before"] == pytest.approx(0.29 / 1.01)


def test_a_wrong_answer_scores_against() -> None:
    scored = score(("friction_drift",), 1.1, report((["viscous_damping"], 0.97), (["friction_drift"], 0.03)))
    assert not scored["right"]
    assert not scored["held"]
    assert not scored["covered"]
    assert scored["truth_rank"] == 1
    never = score(("outliers",), 1.0, report(([], 1.0)))
    assert never["truth_rank"] == -1
    assert never["truth_probability"] == 0.0


def test_probabilities_must_sum_to_one() -> None:
    with pytest.raises(ValueError, match=r"sum to 0\.9"):
        score((), 1.0, report(([], 0.9)))


def test_a_refusal_counts_as_wrong_everywhere() -> None:
    scored = score((), 1.0, loop_blind.REFUSED)
    assert not scored["right"]
    assert not scored["held"]
    assert not scored["covered"]
    assert scored["error_after"] == math.inf


def test_standard_errors() -> None:
    assert rate_error(0.5, 100) == pytest.approx(0.05)
    assert rate_error(0.0, 100) > 0.0
    values = np.random.default_rng(5).normal(size=4000)
    # sd of the median of a normal sample: sqrt(pi / 2 / n)
    assert median_error(values) == pytest.approx(math.sqrt(math.pi / 2.0 / 4000), rel=0.3)


def scored_records(n: int, **fixed: Any) -> xr.Dataset:
    """A dataset of ``n`` perfect records, with what is given put in its place."""
    columns: dict[str, Any] = {
        "kind": ["cubic_stiffness"] * n,
        "visible": ["cubic_stiffness"] * n,
        "quantity": ["angle"] * n,
        "verdict": ["explained"] * n,
        "outside": [False] * n,
        "identifiable": [True] * n,
        "right": [True] * n,
        "held": [True] * n,
        "covered": [i % 10 > 0 for i in range(n)],
        "error_before": [0.2] * n,
        "error_after": [0.002] * n,
        "said_probability": [0.99] * n,
        "truth_rank": [0] * n,
        "snr_db": [23.0, 33.0] * (n // 2),
        "half_cycles": [40] * n,
        "mid_motion": [False] * n,
        "reaches_rest": [True] * n,
        "elapsed": [1.0] * n,
    } | fixed
    dataset = xr.Dataset({name: ("record", np.asarray(values)) for name, values in columns.items()})
    dataset["probabilities"] = (("record", "candidate"), np.tile([0.99, 0.01, np.nan], (n, 1)))
    return dataset


def test_figures_of_perfect_records_reach_every_target() -> None:
    kinds = ["cubic_stiffness"] * 40 + ["plain_coulomb"] * 40 + ["rough_patch"] * 20
    dataset = scored_records(
        100,
        kind=kinds,
        outside=[kind == "rough_patch" for kind in kinds],
        identifiable=[kind == "cubic_stiffness" for kind in kinds],
        verdict=["explained"] * 40 + ["adequate"] * 40 + ["unexplained"] * 20,
    )
    figures = figures_of_merit(dataset)
    assert [figure.name for figure in figures if not figure.reached] == []
    assert [figure.n for figure in figures] == [40, 40, 40, 80, 40, 40, 40, 20, 80, 100]
    assert figures[0].value == 0.0
    assert figures[0].failed.sum() == 0


def test_each_fault_shows_in_its_own_figure() -> None:
    kinds = ["cubic_stiffness"] * 40 + ["plain_coulomb"] * 40 + ["rough_patch"] * 20
    outside = [kind == "rough_patch" for kind in kinds]
    faulty = scored_records(
        100,
        kind=kinds,
        outside=outside,
        identifiable=[kind == "cubic_stiffness" for kind in kinds],
        verdict=["explained"] * 100,
        right=[False] * 100,
        held=[False] * 100,
        covered=[True] * 100,
        error_after=[0.15] * 100,
        truth_rank=[-1] * 100,
        elapsed=[3.0] * 100,
    )
    figures = figures_of_merit(faulty)
    assert [figure.name for figure in figures if figure.reached] == []
    assert figures[0].value == 1.0
    assert figures[0].failed.sum() == 40


def test_reliability_tells_overconfidence_from_honesty(rng: np.random.Generator) -> None:
    n = 2000
    top = rng.uniform(0.5, 1.0, n)
    honest = scored_records(n, truth_rank=np.where(rng.random(n) < top, 0, 1))
    honest["probabilities"] = (("record", "candidate"), np.column_stack([top, 1.0 - top]))
    everything = np.ones(n, dtype=bool)
    # largest of at most 8 bins: beyond 4.5 about once in 20,000 seeds
    assert float(np.abs(reliability(honest, everything)["z"]).max()) < 4.5
    boastful = honest.copy()
    boastful["probabilities"] = (("record", "candidate"), np.column_stack([top**0.1, 1.0 - top**0.1]))
    assert float(np.abs(reliability(boastful, everything)["z"]).max()) > 8.0


def test_what_failures_have_in_common() -> None:
    right = np.ones(200, dtype=bool)
    right[:60:2] = False  # 30 failures, all at 23 dB
    dataset = scored_records(200, right=right)
    figure = figures_of_merit(dataset)[1]
    traits = common_traits(dataset, figure)
    assert traits == [("22-26 dB", 30, 100)]


def test_a_cell_runs_on_record_and_system_alone(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    handed: list[Any] = []

    def oracle(
        records: list[xr.DataArray], system: fb.Oscillator, *, seed: int, check: bool
    ) -> SimpleNamespace:
        handed.append((records, system, seed, check))
        return SimpleNamespace(to_dict=lambda: report(([], 0.7), (["outliers"], 0.3), verdict="adequate"))

    monkeypatch.setattr(fb, "close_loop", oracle, raising=False)
    cells = [{"kind": kind, "replicate": 0} for kind in ("plain_coulomb", "outliers", "sensor_offset")]
    results = [loop_blind.run(loop_blind.Config(), c, np.random.SeedSequence(seed)) for c in cells]
    assert [result["right"] for result in results] == [True, False, False]
    assert [result["held"] for result in results] == [True, True, False]
    (records, system, _, check), *_ = handed
    assert len(records) == 1
    assert isinstance(system, fb.Oscillator)
    assert not check
    dataset = loop_blind.assemble(cells, results)
    table = loop_blind.rows(dataset)
    assert table[0].what == "false alarm on plain Coulomb records"
    assert any(row.what.startswith("failed: outliers") for row in table)


def test_full_run_extends_the_default_one() -> None:
    config = loop_blind.Config(records=2, records_full=3, plain_records=4)
    default, full = loop_blind.cells(config, False), loop_blind.cells(config, True)
    assert all(cell in full for cell in default)
    assert sum(cell["kind"] == "plain_coulomb" for cell in full) == 4
    assert sum(cell["kind"] == "outliers" for cell in full) == 3


def test_set_names_do_not_depend_on_order() -> None:
    assert set_name(["b", "a"]) == set_name(("a", "b")) == "a+b"
    assert set_name([]) == "none"
