"""From tiny experiments to the comparison with the paper and to every figure, which only read results."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from experiments import (
    acceptance_roc,
    data_used,
    estimated_response,
    example_choices,
    gamma_exponential,
    noise_sweep,
    prior_sweep,
    probability_paper,
    random_force_verdict,
    reduced_data_set,
    residuals_traced,
    rig_sensors,
    sampling_rate_sweep,
    shown_machine,
    shown_records,
    testbed_choices,
)
from experiments import paper_numbers as table_of_numbers
from experiments.article import main as article_main
from experiments.paper_comparison import (
    band_with_errors,
    compare_with_paper,
    needed_results,
    verdict,
    write_comparison,
)
from experiments.paper_comparison import main as comparison_main
from experiments.paper_numbers import paper_numbers
from experiments.paper_page import CHOSEN, OTHER, comparison_page, counted
from experiments.rig import Rig, run_rig, true_friction
from experiments.runner import main
from friction_bayes.plotting.style import styled
from paper_figures.__main__ import all_figures
from paper_figures.drawing import MissingResult, PaperFigure, figures_page, make

ROOT = Path(__file__).parents[2]
PAPER_SWEEP = {"records": 1, "records_paper": 2, "checked": 0}
TINY: dict[Any, dict[str, Any]] = {
    noise_sweep: PAPER_SWEEP | {"snr_db": (20.0, 14.7, 8.6)},
    reduced_data_set: PAPER_SWEEP,
    sampling_rate_sweep: PAPER_SWEEP | {"keep_every": (1, 10, 100), "quantities": ("acceleration",)},
    data_used: {"records": 3, "checked": 0},
    gamma_exponential: {"records": 1, "records_paper": 2, "checked": 0, "frictions": (0.07, 1.0)},
    probability_paper: {"records": 2},
    example_choices: {"records": 1, "checked": 0, "choices": ("release 14.4 mm", "100 Hz")},
    rig_sensors: {"records": 2},
    testbed_choices: {"records": 1, "checked": 0, "choices": ("as chosen", "prior as drawn")},
    residuals_traced: {"records": 2, "checked": 0, "keep_every": (1, 10, 100)},
    acceptance_roc: {
        "records": 4,
        "checked": 0,
        "noise": (1.0,),
        "keep_every": (1, 100),
        "last_shares": (1.0, 0.2),
        "set_ups": 1,
    },
    shown_records: {"grid": 21, "check": False},
    shown_machine: {"points": 4, "grid": 41},
    prior_sweep: {
        "records": 2,
        "checked": 0,
        "friction_means": (0.5,),
        "friction_weights": (0.05,),
        "precision_means": (5.0,),
        "precision_weights": (2.0,),
    },
    random_force_verdict: {
        "records": 1,
        "checked": 0,
        "checked_forced": 0,
        "sizes": (0.0, 0.2),
        "other_times": (),
        "noise": (5e-4,),
        "sampling_rate": 100.0,
        "testbed": (),
    },
    estimated_response: {"records": 2},
}


def test_from_experiments_to_comparison_and_figures(tmp_path: Path) -> None:
    # one test, so that workers of a parallel run do not each compute the experiments
    folder = tmp_path / "results"
    for module, settings in TINY.items():
        experiment = replace(module.EXPERIMENT, config=replace(module.EXPERIMENT.config, **settings))
        found = main(experiment, ["--workers", "1", "--results", str(folder)])
        if module in (noise_sweep, reduced_data_set, sampling_rate_sweep):
            assert found["refused"].sum() == 0
            assert np.isfinite(found["error"]).all()
    rows = check_comparison(folder)
    check_figures(folder, tmp_path / "figures")
    check_results_of_other_sources(folder, tmp_path)
    # written by the last of these
    check_article((tmp_path / "page.md").read_text(), rows)


def check_comparison(results: Path) -> list[dict[str, Any]]:
    """It has a row for every number of the paper, and the rows say what the results say."""
    comparison = compare_with_paper(results)
    rows = comparison["rows"]
    assert [row["id"] for row in rows] == list(paper_numbers())
    for row in rows:
        number = paper_numbers()[row["id"]]
        assert (row["paper"], row["unit"], row["place"]) == (number.value, number.unit, number.place)
        for reading, ours in row["ours"].items():
            assert reading in ("", "waveform", CHOSEN, OTHER)
            assert ours["low"] <= ours["median"] <= ours["high"]
            assert (ours["verdict"] is None) == (row["kind"] != "result")
    own = [row for row in rows if row["kind"] == "result" and not row["restates"]]
    # what is read off picked peaks is judged by the same reading throughout, and has the other next to it
    assert sum(CHOSEN in row["ours"] and OTHER in row["ours"] for row in own) == len(own) == 15
    for reading in (CHOSEN, OTHER):
        assert sum(counted(rows, reading).values()) == len(own)
    by_hand = xr.open_dataset(results / "reduced_data_set.nc", engine="h5netcdf")
    mine = by_hand["error"].sel(data_set="2").sel({"method": "normal-gamma, nominal"}).values
    row = next(r for r in rows if r["id"] == "error-2")
    assert row["ours"][OTHER]["median"] == pytest.approx(100.0 * np.median(np.abs(mine)))
    by_hand.close()
    stored = json.loads(write_comparison(results, results / "page.md").read_text())
    assert stored["rows"] == json.loads(json.dumps(rows))
    page = (results / "page.md").read_text()
    assert page == comparison_page(comparison)
    assert page.count("\n| ") == len(rows) + 6
    assert "± " in page
    return rows


def check_article(reported: str, rows: list[dict[str, Any]]) -> None:
    """Every number is filled in, and counts are those of the comparison."""
    assert "{" not in reported
    assert "nan" not in reported
    assert f"{counted(rows, CHOSEN)['in']} of them lie in our band" in reported


def check_figures(results: Path, out: Path) -> None:
    """Every figure draws from stored results; one is written, once."""
    drawn: list[PaperFigure] = []
    stored: dict[str, xr.Dataset] = {}
    computed = {module.EXPERIMENT.name for module in TINY}
    for figure in all_figures():
        if not set(figure.results) <= computed:
            # of an experiment that has tests of its own
            with pytest.raises(MissingResult, match=f"{figure.name}: no "):
                make(figure, results, out)
            continue
        for name in set(figure.results) - set(stored):
            stored[name] = xr.load_dataset(results / f"{name}.nc", engine="h5netcdf")
        with styled():
            figure.draw(stored).draw_without_rendering()
        drawn.append(figure)
    assert len(drawn) >= 19
    assert make(drawn[0], results, out)
    for kind in ("png", "pdf"):
        assert (out / f"{drawn[0].name}.{kind}").stat().st_size > 5000
    assert not make(drawn[0], results, out), "it is up to date"
    (out / f"{drawn[0].name}.pdf").unlink()
    assert make(drawn[0], results, out), "half of it was lost"


def check_results_of_other_sources(results: Path, folder: Path) -> None:
    """Neither figure nor page is made of results that other sources computed."""
    record = results / "noise_sweep.json"
    stored = json.loads(record.read_text())
    record.write_text(json.dumps(stored | {"sources": "0" * 64}))
    (figure,) = (each for each in all_figures() if each.name == "efficiency")
    with pytest.raises(MissingResult, match=r"noise_sweep\.nc was computed by other sources than these"):
        make(figure, results, folder / "other")
    for page in (article_main, comparison_main):
        with pytest.raises(SystemExit):
            page(["--results", str(results), "--docs", str(folder / "page.md")])
    assert not (folder / "page.md").exists()
    record.write_text(json.dumps(stored))
    article_main(["--results", str(results), "--docs", str(folder / "page.md")])
    assert (folder / "page.md").exists()


def test_one_friction_sample_has_no_precision(tmp_path: Path) -> None:
    settings = {"choices": ("release 8 mm",), "data_sets": ("2-reduced",), "records": 6, "checked": 0}
    experiment = testbed_choices.EXPERIMENT
    experiment = replace(experiment, config=replace(experiment.config, **settings))
    found = main(experiment, ["--workers", "1", "--results", str(tmp_path)])
    single = found["amplitudes"] < 3.0
    assert 0 < single.sum() < single.size
    assert np.isfinite(found["friction"]).all()
    assert (found["precision"].isnull() == single).all()
    assert (found["precision"].max() < 1e6).all()
    assert "of one sample, which has no precision" in (tmp_path / "testbed_choices.md").read_text()


def test_every_figure_of_the_paper_stands_beside_ours() -> None:
    names = [figure.name for figure in all_figures() if figure.paper]
    assert names == [f"figure_{number:02d}" for number in (*range(1, 5), *range(6, 15))]
    page = (ROOT / "docs" / "paper_figures.md").read_text(encoding="utf-8")
    assert page == figures_page(all_figures())
    assert all((ROOT / "docs" / "figures" / f"{name}.png").is_file() for name in names)


ALLOWED = (
    "friction_bayes.plotting",
    "friction_bayes.core.files",
    "paper_figures",
    "experiments.paper_numbers",
    "experiments.sources",
)


def test_figures_read_and_never_estimate() -> None:
    for path in sorted((ROOT / "paper_figures").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            ours = [name for name in names if name.split(".")[0] in ("friction_bayes", "experiments")]
            assert all(name.startswith(ALLOWED) for name in ours), f"{path.name}: {ours}"
    heavy = ("emcee", "friction_bayes.conjugate", "friction_bayes.estimators.estimate")
    assert all(find_spec(name) for name in heavy)
    script = (
        "import sys\nfrom paper_figures.__main__ import all_figures\nall_figures()\n"
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_table_of_numbers_points_at_results_that_exist() -> None:
    numbers = paper_numbers()
    assert len(numbers) >= 30
    assert set(needed_results()) <= {module.EXPERIMENT.name for module in TINY}
    # what a number restates is a result of its own, or restates one
    assert {numbers[each.restates].kind for each in numbers.values() if each.restates} == {"result"}
    assert all(each.ours for each in numbers.values() if each.kind != "input")


def test_verdict_is_undecided_within_the_error_of_an_edge() -> None:
    values = np.random.default_rng(1).standard_normal(400)
    ours = band_with_errors(values)
    # of a normal distribution: sqrt(p (1 - p) / n) over the density at the edge
    assert ours["low_error"] == pytest.approx(0.106, rel=0.4)
    assert ours["low"] == pytest.approx(-1.645, abs=3.0 * ours["low_error"])
    for edge, sign in (("low", -1.0), ("high", 1.0)):
        error = ours[f"{edge}_error"]
        near = [verdict(ours[edge] + sign * step * error, ours) for step in (-1.1, -0.9, 0.9, 1.1)]
        assert near == ["in", "undecided", "undecided", "out"]
    assert verdict(0.0, ours) == "in"
    assert verdict(0.0, ours | {"records": 1}) is None


@pytest.mark.parametrize(
    ("line", "words"), [("", "occurs twice"), ("ours = { experimant = 'x' }", "unknown experimant")]
)
def test_table_of_numbers_refuses_slips(
    line: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = "[[number]]\nid = 'a'\nvalue = 1\nunit = ''\nplace = ''\ntext = ''\nkind = 'result'\n"
    table = tmp_path / "numbers.toml"
    table.write_text(f"{entry}{line}\n{'' if line else entry}")
    monkeypatch.setattr(table_of_numbers, "TABLE", table)
    with pytest.raises(ValueError, match=words):
        paper_numbers.__wrapped__()
    with pytest.raises(ValueError, match="unknown kind 'measured'"):
        table_of_numbers.PaperNumber(id="a", value=1.0, unit="", place="", kind="measured")


def test_area_under_the_curve() -> None:
    score = np.array([3.0, 2.0, 2.0, 1.0])
    good = np.array([True, True, False, False])
    # pairs: 3 > 2, 3 > 1, 2 = 2, 2 > 1
    assert acceptance_roc.roc_area(score, good) == pytest.approx(3.5 / 4.0)
    assert np.isnan(acceptance_roc.roc_area(score, np.ones(4, dtype=bool)))
    grid = np.linspace(0.0, 1.0, 2001)
    curve = acceptance_roc.roc_curve(score, good, grid)
    assert np.trapezoid(curve, grid) == pytest.approx(3.5 / 4.0, abs=1e-3)


def test_the_twin_is_synthetic_and_repeats_itself() -> None:
    rig = Rig()
    first, again, other = (run_rig(rig, 0.1834, seed=seed) for seed in (5, 5, 6))
    for name, signal in first.items():
        assert signal.attrs["synthetic"] is True
        np.testing.assert_array_equal(signal.values, again[name].values)
    assert not np.array_equal(first["acceleration"].values, other["acceleration"].values)
    # 15 % of scatter over 20 ms in some 12 s: 0.9 % of the mean, five of them
    assert true_friction(first) == pytest.approx(0.1834, rel=0.045)
    code = 2.0 * rig.accelerometer_range * 9.80665 / 2**rig.bits
    steps = first["acceleration"].values / code
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
