"""The experiment on measured records, with synthetic ones in their place: tables, figure, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import SYSTEM, short_decay
from experiments import measured_estimates, measured_figures
from experiments.runner import main


def record_of(name: str) -> tuple[xr.DataArray, fb.Oscillator]:
    if name == "made-up/lost":
        raise fb.InputError("dataset:made-up", "cannot download", "name a folder")
    if name == "made-up/still":
        return fb.simulate(
            SYSTEM, friction=5.0, initial_displacement=1e-4, duration=2.0, sampling_rate=100.0
        ), SYSTEM
    return short_decay(duration=6.0, effects={"viscous_damping.damping_ratio": 0.01}), SYSTEM


def test_tables_and_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made_up = SimpleNamespace(name="made-up", parts={"1": None, "still": None})
    monkeypatch.setattr(measured_estimates, "list_datasets", lambda: [made_up])
    monkeypatch.setattr(measured_estimates, "dataset_record", record_of)
    config = replace(measured_estimates.EXPERIMENT.config, methods=("envelope",), points=200)
    experiment = replace(measured_estimates.EXPERIMENT, config=config, details=None)
    found = main(experiment, ["--workers", "1", "--results", str(tmp_path)])
    assert found["record"].values.tolist() == ["made-up/1", "made-up/still"]
    good, refused = found.isel(case=0), found.isel(case=1)
    assert float(good["low"]) < float(good["friction"]) < float(good["high"])
    assert float(good["rhat"]) < 1.01
    # viscous damping takes more from large swings, which is not what dry friction does
    assert float(good["drop_early"]) > 1.05 * float(good["drop_late"])
    assert np.isnan(float(refused["friction"]))
    table = (tmp_path / "measured_estimates.md").read_text(encoding="utf-8")
    assert "| made-up/still, envelope | refused |" in table
    monkeypatch.setattr(
        "sys.argv", ["measured_figures", "--results", str(tmp_path), "--out", str(tmp_path / "figures")]
    )
    measured_figures.main()
    assert [path.name for path in (tmp_path / "figures").iterdir()] == ["made-up-1.png"]
    record = tmp_path / "measured_estimates.json"
    record.write_text(json.dumps(json.loads(record.read_text(encoding="utf-8")) | {"sources": "others"}))
    with pytest.raises(SystemExit):
        measured_figures.main()
    assert "computed by other sources than these" in capsys.readouterr().err


def test_a_record_that_is_not_there_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lost = SimpleNamespace(name="made-up", parts={"lost": None})
    monkeypatch.setattr(measured_estimates, "list_datasets", lambda: [lost])
    monkeypatch.setattr(measured_estimates, "dataset_record", record_of)
    with pytest.raises(fb.InputError, match="cannot download"):
        main(measured_estimates.EXPERIMENT, ["--workers", "1", "--results", str(tmp_path)])
    assert not list(tmp_path.glob("measured_estimates.*[!s]"))
