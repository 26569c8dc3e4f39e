"""``--resume``: an interrupted run goes on to the very bits of one that was not interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import short_decay
from fleets import numbers_of, write_fleet
from friction_bayes.cli import fleet_run
from friction_bayes.cli.program import main
from friction_bayes.records import fleet
from refusals import refused

MACHINES, POINTS = 3, 2
SYSTEM = ("--mass", "10", "--stiffness", "1000")
PARTS = {"monitor": MACHINES, "estimate": MACHINES, "close-loop": MACHINES * POINTS}
# a loop over few effects is one all the same, and a machine without a remaining life
OPTIONS = {
    "monitor": (),
    "estimate": ("--random-force", "none"),
    "close-loop": ("--effects", "viscous_damping", "--random-force", "none"),
}
WRITERS = {
    "monitor": "friction_bayes.cli.commands.monitor",
    "estimate": "friction_bayes.cli.fleet_estimate",
    "close-loop": "friction_bayes.cli.fleet_loop",
}


def write_machines(path: Path, friction: float = 0.3) -> xr.DataArray:
    """Write a fleet of small machines, the last of which has an empty record."""
    rows = [
        [
            short_decay(friction=friction + 0.02 * (m + 1) * i, duration=4.0, seed=10 * m + i)
            for i in range(POINTS)
        ]
        for m in range(MACHINES)
    ]
    rows[-1][-1][:] = np.nan
    return write_fleet(path, rows)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, without_figures: None) -> Callable[..., int]:
    """Run a command on ``fleet.zarr``; return how many parts were done, stopping after some if requested."""
    # a part is then a chunk of the store
    monkeypatch.setattr(fleet, "_BLOCK_BYTES", 1)
    write_machines(tmp_path / "fleet.zarr")

    def command(name: str, out: str, *options: str, stop_after: int | None = None) -> int:
        done = 0

        def counted(file: Path, write: Callable[[Path], Any]) -> None:
            nonlocal done
            if done == stop_after:
                raise KeyboardInterrupt
            done += 1
            write(file)

        monkeypatch.setattr(f"{WRITERS[name]}.write_whole", counted)
        argv = [name, str(tmp_path / "fleet.zarr"), *SYSTEM, "--workers", "1", "--out", str(tmp_path / out)]
        assert main([*argv, *OPTIONS[name], *options]) == (0 if stop_after is None else 130)
        return done

    return command


def parts_left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("."))


@pytest.mark.parametrize("name", PARTS)
def test_an_interrupted_run_goes_on(
    name: str,
    run: Callable[..., int],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    end = ".zarr" if name == "estimate" else ""
    assert run(name, f"whole{end}") == PARTS[name]
    assert run(name, f"broken{end}", stop_after=1) == 1
    assert "--resume continues" in capsys.readouterr().err
    assert not (tmp_path / f"broken{end}").exists()
    assert len(parts_left(tmp_path)) == 1
    assert run(name, f"broken{end}", "--resume") == PARTS[name] - 1
    assert parts_left(tmp_path) == []
    assert numbers_of(tmp_path / f"broken{end}") == numbers_of(tmp_path / f"whole{end}")
    # of a run that was killed after its last part
    (tmp_path / f".broken{end}.parts-0123").mkdir()
    said: list[str] = []
    monkeypatch.setattr(fleet_run, "note", said.append)
    assert run(name, f"broken{end}", "--resume") == 0
    assert ["is finished already" in text for text in said] == [True]
    assert parts_left(tmp_path) == []


def test_another_result_is_not_taken_for_the_finished_one(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("estimate", "out.zarr")
    write_machines(tmp_path / "fleet.zarr", friction=0.31)
    capsys.readouterr()
    again = ("estimate", str(tmp_path / "fleet.zarr"), *SYSTEM, *OPTIONS["estimate"], "--resume")
    assert "already exists" in refused(capsys, *again, "--out", str(tmp_path / "out.zarr"))


def test_a_fleet_is_estimated_as_its_array_is(run: Callable[..., int], tmp_path: Path) -> None:
    run("estimate", "estimates.zarr")
    values = (
        write_machines(tmp_path / "fleet.zarr").stack(record=("machine", "point")).transpose("record", ...)
    )
    expected = fb.estimate_batch(
        values.values,
        fb.Oscillator(mass=10.0, stiffness=1000.0),
        sampling_rate=1.0 / float(values["time"][1] - values["time"][0]),
        random_force="none",
    )
    found = xr.load_dataset(tmp_path / "estimates.zarr", engine="zarr")
    assert found["machine"].values.tolist() == ["a", "aa", "aaa"]
    for variable in ("friction_mean", "friction_interval90", "noise_sd", "status", "warnings"):
        flat = found[variable].values.reshape(expected[variable].shape)
        np.testing.assert_allclose(flat, expected[variable].values, rtol=1e-10)
    assert found["friction_mean"].attrs["units"] == "N"
    assert json.loads(found.attrs["manifest"])["command"] == "estimate"


def test_a_loop_of_a_fleet_has_a_line_for_each_record(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("close-loop", "loops", "--json")
    counts = json.loads(capsys.readouterr().out)
    assert counts == {"records": 6, "verdict": {"adequate": 5, "refused": 1}, "effects": {}}
    reports = [json.loads(line) for line in (tmp_path / "loops" / "reports.jsonl").read_text().splitlines()]
    heading, *rows = (tmp_path / "loops" / "loop.csv").read_text().splitlines()
    assert heading == "machine,point,verdict,effects,friction,sd,low,high,unit"
    for report, row in zip(reports[:-1], rows[:-1], strict=True):
        friction = report["friction_after"]
        numbers = [friction["mean"], friction["sd"], *friction["interval90"]]
        where = f"{report['machine']},{report['point']},{report['verdict']},,"
        assert row == f"{where}{','.join(map(repr, numbers))},N"
    assert "machine aaa, point 1: signal is nan" in reports[-1]["refused"]
    assert rows[-1] == "aaa,1,refused,,,,,,"


def test_without_resume_a_run_starts_anew(run: Callable[..., int], tmp_path: Path) -> None:
    run("estimate", "out.zarr", stop_after=2)
    assert run("estimate", "out.zarr") == MACHINES
    assert parts_left(tmp_path) == []


def test_a_changed_option_or_input_starts_anew_and_says_so(
    run: Callable[..., int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(fleet_run, "note", said.append)
    run("estimate", "out.zarr", stop_after=2)
    assert run("estimate", "out.zarr", "--peaks", "nominal", "--resume", stop_after=2) == 2
    assert len(said) == 1
    assert "starting anew" in said[0]
    write_machines(tmp_path / "fleet.zarr", friction=0.31)
    assert run("estimate", "out.zarr", "--peaks", "nominal", "--resume") == MACHINES
    assert ["starting anew" in text for text in said] == [True, True]
    assert parts_left(tmp_path) == []


def test_nothing_done_leaves_nothing(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run("estimate", "deep/out.zarr", stop_after=0)
    assert "nothing was written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["fleet.zarr"]


def test_records_take_no_resume(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["monitor", "a.csv", "b.csv", *SYSTEM, "--resume"]
    assert main([*argv, "--out", str(tmp_path / "out")]) == 2
    assert "--resume: is for a fleet" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--out: is missing"),
        (("--out", "estimates"), "give a name that ends in .zarr"),
        (("--out", "fleet.zarr"), "already exists"),
        (("--out", "fleet.zarr", "--force"), "is no result of estimate"),
        (("--out", "new.zarr", "--start", "1"), "--start: does not apply to a fleet"),
        (("--out", "new.zarr", "--check"), "--check: does not apply to a fleet"),
        (("--out", "new.zarr", "--workers", "0"), "is not a number of processes"),
        (("--out", "new.zarr", "--method", "gibbs"), "unknown method"),
        (("--out", "new.zarr", "--scheduler", "pigeon://post"), "--scheduler: pigeon://post does not answer"),
    ],
    ids=lambda value: "" if isinstance(value, str) else " ".join(value),
)
def test_refusals_of_a_fleet(
    options: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    write_machines(tmp_path / "fleet.zarr")
    assert said in refused(capsys, "estimate", "fleet.zarr", *SYSTEM, *options)
    assert [path.name for path in tmp_path.iterdir()] == ["fleet.zarr"]


def test_an_earlier_result_is_replaced_where_asked(run: Callable[..., int], tmp_path: Path) -> None:
    run("estimate", "out.zarr")
    write_machines(tmp_path / "fleet.zarr", friction=0.31)
    before = numbers_of(tmp_path / "out.zarr")
    run("estimate", "out.zarr", "--force")
    assert numbers_of(tmp_path / "out.zarr") != before
    assert {path.name for path in tmp_path.iterdir()} == {"fleet.zarr", "out.zarr"}
