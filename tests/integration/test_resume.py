"""``--resume``: an interrupted run goes on to the very bits of one that was not interrupted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from decays import short_decay
from friction_bayes.cli.program import main
from friction_bayes.monitor import resumable_run

MACHINES = 3


def write_fleet(path: Path, friction: float = 0.3) -> None:
    """Write a fleet of small machines, one a chunk."""
    rows = [
        [short_decay(friction=friction + 0.02 * (m + 1) * i, duration=4.0, seed=10 * m + i) for i in range(3)]
        for m in range(MACHINES)
    ]
    array = xr.DataArray(
        np.array([[record.values for record in row] for row in rows]),
        dims=("machine", "point", "time"),
        coords={"time": rows[0][0]["time"].values},
        attrs={"units": "m"},
    )
    dataset = array.to_dataset(name="displacement").chunk({"machine": 1})
    dataset.to_zarr(path, mode="w", consolidated=False, zarr_format=2)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_figures: None) -> Callable[..., int]:
    """Monitor ``fleet.zarr``; return how many parts were computed, stopping after some when told."""
    write_fleet(tmp_path / "fleet.zarr")

    def monitor(out: str, *options: str, stop_after: int | None = None) -> int:
        done = 0

        def counted(file: Path, write: Callable[[Path], Any]) -> None:
            nonlocal done
            if done == stop_after:
                raise KeyboardInterrupt
            done += 1
            write(file)

        monkeypatch.setattr(resumable_run, "write_whole", counted)
        argv = ["monitor", str(tmp_path / "fleet.zarr"), "--mass", "10", "--stiffness", "1000"]
        argv += ["--workers", "1", "--out", str(tmp_path / out), *options]
        assert main(argv) == (0 if stop_after is None else 130)
        return done

    return monitor


def left_beside(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("."))


def test_an_interrupted_run_goes_on(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("whole", "--threshold", "0.6") == MACHINES
    assert run("broken", "--threshold", "0.6", stop_after=1) == 1
    assert "--resume continues" in capsys.readouterr().err
    assert not (tmp_path / "broken").exists()
    assert len(left_beside(tmp_path)) == 1
    assert run("broken", "--threshold", "0.6", "--resume") == MACHINES - 1
    assert left_beside(tmp_path) == []
    first, second = (
        xr.load_dataset(tmp_path / name / "monitor.nc", engine="h5netcdf", decode_timedelta=False)
        for name in ("whole", "broken")
    )
    xr.testing.assert_identical(first, second)
    texts = [(tmp_path / name / "monitor.json").read_bytes() for name in ("whole", "broken")]
    assert texts[0] == texts[1]


def test_without_resume_a_run_starts_anew(run: Callable[..., int], tmp_path: Path) -> None:
    run("out", stop_after=2)
    assert run("out") == MACHINES
    assert left_beside(tmp_path) == []


def test_a_changed_option_or_input_starts_anew_and_says_so(
    run: Callable[..., int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr("friction_bayes.cli.commands.monitor.note", said.append)
    run("out", "--threshold", "0.6", stop_after=2)
    assert run("out", "--threshold", "0.7", "--resume", stop_after=2) == 2
    assert len(said) == 1
    assert "starting anew" in said[0]
    write_fleet(tmp_path / "fleet.zarr", friction=0.31)
    assert run("out", "--threshold", "0.7", "--resume") == MACHINES
    assert ["starting anew" in text for text in said] == [True, True, False]
    assert "report.html and figures" in said[-1]
    assert left_beside(tmp_path) == []


def test_nothing_done_leaves_nothing(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("deep/out", stop_after=0)
    assert "nothing was written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["fleet.zarr"]


def test_records_take_no_resume(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["monitor", "a.csv", "b.csv", "--mass", "10", "--stiffness", "1000", "--resume"]
    assert main([*argv, "--out", str(tmp_path / "out")]) == 2
    assert "--resume: is for a fleet" in capsys.readouterr().err
