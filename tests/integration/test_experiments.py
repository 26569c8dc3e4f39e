"""Each experiment on a tiny configuration: what it writes, that it resumes, that it repeats itself."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from experiments import __main__ as all_of_them
from experiments import noise_sweep, reduced_data_set, runner, sampling_rate_sweep
from experiments.runner import Cell, Experiment, main
from experiments.sources import ROOT, sources_digest, sources_of
from friction_bayes import InputError

PAPER_METHODS = ("normal-gamma, highest", "normal-gamma, nominal", "gamma-exponential")
TINY = {
    "noise_sweep": (noise_sweep.EXPERIMENT, {"snr_db": (20.0, 8.6)}),
    "sampling_rate_sweep": (sampling_rate_sweep.EXPERIMENT, {"keep_every": (1, 100)}),
    "reduced_data_set": (reduced_data_set.EXPERIMENT, {}),
}


def tiny(name: str, **changes: Any) -> Experiment:
    experiment, levels = TINY[name]
    settings = {"records": 2, "records_paper": 2, "checked": 0, "methods": PAPER_METHODS} | levels | changes
    return replace(experiment, config=replace(experiment.config, **settings))


def run(experiment: Experiment, folder: Path, *options: str) -> xr.Dataset:
    return main(experiment, ["--workers", "1", "--results", str(folder), *options])


def test_leaves_dataset_manifest_and_tables(tmp_path: Path) -> None:
    """Of one; numbers of the others with a place in the paper are looked at in ``test_paper.py``."""
    name = "reduced_data_set"
    computed = run(tiny(name), tmp_path)
    with xr.open_dataset(tmp_path / f"{name}.nc", engine="h5netcdf") as saved:
        xr.testing.assert_equal(saved.load(), computed)
    assert computed["friction"].dims[-2:] == ("replicate", "method")
    assert computed["refused"].sum() == 0
    assert np.all(np.isfinite(computed["error"]))
    manifest = json.loads((tmp_path / f"{name}.json").read_text())
    assert manifest["seed"] == 20210607
    assert manifest["options"]["config"]["records"] == 2
    assert any(row["paper"] for row in manifest["table"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        f"{name}{end}" for end in (".json", ".md", ".nc")
    ]


def test_whole_signal_beats_the_paper(tmp_path: Path) -> None:
    methods = ("waveform", "envelope")
    found = run(tiny("noise_sweep", snr_db=(20.0,), records=4, records_paper=4, methods=methods), tmp_path)
    worst = abs(found["error"].sel(snr_db=20.0)).max("replicate")
    # at 20 dB: Cramer-Rao bound 0.11 %, the drops between highest samples scatter by 5 %
    assert float(worst.sel({"method": "waveform"})) < 0.01
    assert float(worst.sel({"method": "envelope"})) < 0.01


def test_checks_with_emcee(tmp_path: Path) -> None:
    experiment = tiny("reduced_data_set", checked=1, data_sets=("2",), methods=("normal-gamma, highest",))
    found = run(experiment, tmp_path).squeeze("method")
    checked, plain = found.isel(data_set=0, replicate=0), found.isel(data_set=0, replicate=1)
    assert checked["converged"] == 1.0
    assert checked["rhat"] < 1.01
    assert min(checked["ess_bulk"], checked["ess_tail"]) > 1000.0
    # five Monte Carlo standard errors at the least effective sample size
    assert abs(checked["reference_mean"] - checked["friction"]) < 5.0 * checked["sd"] / np.sqrt(1000.0)
    assert checked["time_ratio"] > 1.0
    assert np.isnan(plain["rhat"])


def test_rates_are_cut_from_the_same_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    records: list[xr.DataArray] = []
    measure = sampling_rate_sweep.measure

    def listening(record: xr.DataArray, *others: Any, **options: Any) -> dict[str, Any]:
        records.append(record)
        return measure(record, *others, **options)

    monkeypatch.setattr(sampling_rate_sweep, "measure", listening)
    run(tiny("sampling_rate_sweep", quantities=("acceleration",), methods=PAPER_METHODS[:1]), tmp_path)
    by_size = sorted(records, key=lambda record: record.size)
    slow, fast = by_size[:2], by_size[2:]
    assert not np.array_equal(fast[0].values, fast[1].values)
    kept = [[bool(np.isin(mine.values, all_of.values).all()) for all_of in fast] for mine in slow]
    assert sorted(kept) == [[False, True], [True, False]]
    # which samples are kept is drawn
    assert slow[0]["time"].values[0] != slow[1]["time"].values[0]


def interrupted(experiment: Experiment, calls: list[Cell]) -> Experiment:
    """An experiment that is interrupted at its fourth cell; those that it has run are added to ``calls``."""

    def run_three(config: Any, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
        if len(calls) == 3:
            raise KeyboardInterrupt
        calls.append(cell)
        return experiment.run(config, cell, seed)

    return replace(experiment, run=run_three)


def test_takes_up_an_interrupted_run_with_the_same_bits(tmp_path: Path) -> None:
    experiment = tiny("noise_sweep", snr_db=(20.0,), methods=PAPER_METHODS[:1])
    whole = run(experiment, tmp_path / "whole")
    calls: list[Cell] = []
    with pytest.raises(KeyboardInterrupt):
        run(interrupted(experiment, calls), tmp_path / "resumed")
    assert not (tmp_path / "resumed" / "noise_sweep.nc").exists()
    calls.clear()
    resumed = run(interrupted(experiment, calls), tmp_path / "resumed")
    assert len(calls) == whole.sizes["snr_db"] * whole.sizes["replicate"] - 3
    for name in ("friction", "sd", "precision"):
        xr.testing.assert_equal(resumed[name], whole[name])


def copy_of_the_sources(folder: Path) -> Path:
    for path in sources_of("noise_sweep"):
        copy = folder / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, copy)
    return folder


def test_an_estimator_that_breaks_between_two_runs_is_not_mixed_with_the_sound_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = copy_of_the_sources(tmp_path / "sources")
    monkeypatch.setattr(runner, "sources_digest", lambda name: sources_digest(name, copy))
    experiment = tiny("noise_sweep", snr_db=(20.0,), methods=PAPER_METHODS[:1])
    sound = run(experiment, tmp_path / "sound")
    calls: list[Cell] = []
    with pytest.raises(KeyboardInterrupt):
        run(interrupted(experiment, calls), tmp_path / "resumed")

    estimator = copy / "friction_bayes" / "conjugate" / "normal_gamma.py"
    estimator.write_text(estimator.read_text() + "# doubled\n")
    measure = noise_sweep.measure

    def doubled(*record: Any, **options: Any) -> dict[str, Any]:
        found = measure(*record, **options)
        return found | {"friction": [2.0 * each for each in found["friction"]]}

    monkeypatch.setattr(noise_sweep, "measure", doubled)
    broken = run(experiment, tmp_path / "resumed")
    # no cell of the first run among them, and the same noise all the same
    xr.testing.assert_equal(broken["friction"], 2.0 * sound["friction"])


def test_sources_edited_while_a_run_goes_on_leave_no_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = copy_of_the_sources(tmp_path / "sources")
    monkeypatch.setattr(runner, "sources_digest", lambda name: sources_digest(name, copy))
    estimator = copy / "friction_bayes" / "conjugate" / "normal_gamma.py"
    first = tiny("reduced_data_set", records=1, records_paper=1, methods=PAPER_METHODS[:1])

    def editing(config: Any, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
        estimator.write_text(estimator.read_text() + "# edited\n")
        return first.run(config, cell, seed)

    known = {first.name: replace(first, run=editing), "noise_sweep": tiny("noise_sweep")}
    monkeypatch.setattr(all_of_them, "all_experiments", lambda: known)
    folder = tmp_path / "results"
    with pytest.raises(SystemExit):
        all_of_them.main(["--workers", "1", "--results", str(folder)])
    # the second would have run what was loaded before the edit, under the digest of what came after it
    reported = capsys.readouterr().err
    assert all(f"the sources of {name}: changed while the program ran" in reported for name in known)
    assert not list(folder.rglob("*.*"))


def test_sources_are_the_package_the_module_what_it_imports_and_the_numbers(tmp_path: Path) -> None:
    copy = copy_of_the_sources(tmp_path)
    before = sources_digest("noise_sweep", copy)
    assert before == sources_digest("noise_sweep")
    names = {path.relative_to(copy).as_posix() for path in sources_of("noise_sweep", copy)}
    assert names >= {"friction_bayes/estimators/estimate.py", "experiments/noise_sweep.py"}
    assert names >= {"experiments/sweeps.py", "experiments/runner.py", "experiments/paper_numbers.toml"}
    assert not any("paper_comparison" in name or "blind" in name for name in names)
    assert any("blind/generator" in path.as_posix() for path in sources_of("loop_blind"))
    (copy / "experiments" / "paper_numbers.toml").write_text("")
    assert sources_digest("noise_sweep", copy) != before


def test_a_run_without_its_data_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sound = tiny("reduced_data_set", records=1, records_paper=1)

    def without_data(config: Any, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
        raise InputError("dataset:made-up", "cannot download", "name a folder")

    lost = replace(tiny("noise_sweep"), run=without_data, group="measured")
    known = {lost.name: lost, sound.name: sound}
    monkeypatch.setattr(all_of_them, "all_experiments", lambda: known)
    with pytest.raises(SystemExit) as stopped:
        all_of_them.main(["--workers", "1", "--results", str(tmp_path)])
    assert stopped.value.code == 2
    reported = capsys.readouterr()
    assert "noise_sweep: not run. dataset:made-up: cannot download" in reported.err
    assert "time of each experiment" in reported.out
    assert sorted(tmp_path.glob("*.nc")) == [tmp_path / "reduced_data_set.nc"]
    all_of_them.main(["paper", "--workers", "1", "--results", str(tmp_path)])
    assert "kept" in capsys.readouterr().out


def test_all_keep_what_is_finished_and_end_in_one_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    known = {name: tiny(name, records=1, records_paper=1) for name in ("noise_sweep", "reduced_data_set")}
    monkeypatch.setattr(all_of_them, "all_experiments", lambda: known)
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text("before\n<!-- results: reduced_data_set -->\nold\n<!-- end -->\nafter\n")
    options = ["--workers", "1", "--results", str(tmp_path / "results")]
    all_of_them.main(options)
    assert "all experiments and the paper" in capsys.readouterr().out
    written = (tmp_path / "results" / "noise_sweep.nc").stat().st_mtime_ns
    all_of_them.main([*options, "--docs", str(page.parent)])
    reported = capsys.readouterr()
    assert reported.err.count("kept") == 2
    assert "0.0706 N" in reported.out
    assert "0.1643 N" in reported.out
    assert (tmp_path / "results" / "noise_sweep.nc").stat().st_mtime_ns == written
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("<!-- end -->\nafter\n")
    assert "old" not in text
    assert "| 0.1643 N |" in text


def test_all_experiments_are_found() -> None:
    found = all_of_them.all_experiments()
    assert set(TINY) <= set(found)
    with_paper = [name for name, experiment in found.items() if experiment.heading == "paper"]
    assert list(found)[: len(with_paper)] == sorted(with_paper)


def test_an_unknown_experiment_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        all_of_them.main(["frobnicate"])
    assert stopped.value.code == 2
    assert "no experiment 'frobnicate'" in capsys.readouterr().err


def test_documentation_has_the_tables_of_every_experiment_beside_the_paper() -> None:
    docs = Path(__file__).parents[2] / "docs"
    text = (docs / "experiments.md").read_text(encoding="utf-8")
    with_paper = [name for name, each in all_of_them.all_experiments().items() if each.heading == "paper"]
    assert set(TINY) <= set(with_paper)
    for name in with_paper:
        _, found, rest = text.partition(f"<!-- results: {name} -->\n")
        assert found, name
        assert "| paper |" in rest.partition("<!-- end -->")[0], name
    every_page = "".join(page.read_text(encoding="utf-8") for page in sorted(docs.glob("*.md")))
    written = re.findall(r"<!-- results: (.*) -->\n\n`python -m experiments\.", every_page)
    assert set(with_paper) < set(written) <= set(all_of_them.all_experiments())
