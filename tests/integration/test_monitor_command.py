"""``friction-bayes monitor``: records and fleets, strict JSON, refusals in one line with nothing written."""

from __future__ import annotations

import json
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import short_decay
from friction_bayes.cli.program import main
from friction_bayes.report.monitor_story import memory, monitor_story, next_monitoring
from refusals import refused

SYSTEM = ("--mass", "10", "--stiffness", "1000")
ISO_13374 = [
    "data_acquisition",
    "data_manipulation",
    "state_detection",
    "health_assessment",
    "prognostic_assessment",
    "advisory_generation",
]
FRICTIONS = (0.30, 0.33, 0.37, 0.40)


def record_of(friction: float, seed: int) -> xr.DataArray:
    return short_decay(friction=friction, duration=4.0, seed=seed)


@pytest.fixture
def runs(tmp_path: Path) -> list[str]:
    """Four records of a friction that wears by about 0.0011 N an hour."""
    return [
        str(fb.write_record(record_of(f, i + 1), tmp_path / f"run{i + 1}.csv"))
        for i, f in enumerate(FRICTIONS)
    ]


@pytest.fixture
def fleet(tmp_path: Path) -> Callable[..., Path]:
    """Write a fleet of three pumps, the last of which has one usable record."""

    def write(**changes: Any) -> Path:
        rows = [[record_of(f + 0.01 * m * i, 7 * m + i) for i, f in enumerate(FRICTIONS)] for m in range(3)]
        values = np.array([[record.values for record in row] for row in rows])
        values[2, 1:] = np.nan
        dims = changes.pop("dims", ("machine", "point", "time"))
        array = xr.DataArray(
            values,
            dims=dims,
            coords={
                dims[2]: rows[0][0]["time"].values,
                dims[0]: ["p1", "p2", "p3"],
                "detection_time": (dims[1], [0.0, 30.0, 60.0, 90.0], {"units": "h"}),
            },
            attrs={"units": "m"} | changes,
        )
        if array.attrs["units"] is None:
            del array.attrs["units"]
        path = tmp_path / "fleet.zarr"
        array.to_dataset(name="displacement").to_zarr(path, consolidated=False, zarr_format=2)
        return path

    return write


def strict(path: Path) -> dict[str, Any]:
    def refuse(word: str) -> float:
        raise AssertionError(f"{word} in {path.name}")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def test_records_to_report(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "wear"
    options = ("--times", "0", "30", "60", "90", "--time-unit", "h", "--threshold", "0.6")
    assert main(["monitor", *runs, *SYSTEM, *options, "--out", str(out)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    for words in (
        "remaining life",
        "record alone",
        "with forgetting",
        "nearly all",
        "far better",
        "laws of wear linear",
    ):
        assert words in " ".join(shown.out.split())
    figures = {
        f"{name}.{end}"
        for name in ("detection_points", "tracking", "remaining_life")
        for end in ("png", "pdf")
    }
    files = {"monitor.json", "monitor.nc", "manifest.json", "report.html"}
    assert {path.name for path in out.iterdir()} == {*files, *figures}
    result = strict(out / "monitor.json")
    page = unescape((out / "report.html").read_text(encoding="utf-8"))
    # the table of the terminal, line by line
    for label, text in monitor_story(result):
        assert f"<dt>{label}</dt><dd>{text}</dd>" in page
    advice = result["advisory_generation"]["text"]
    assert f"{advice[0].upper()}{advice[1:]}." in page
    soonest = result["prognostic_assessment"]["remaining_life"]["interval90"][0]
    assert f"<p>Take the next record within {soonest:.4g} h from now: " in page
    for case, words in {
        "no_threshold": "Give --threshold",
        "threshold_passed": "Stop the machine",
        "not_approaching": "Go on recording",
    }.items():
        assert words in next_monitoring({**result, "advisory_generation": {"case": case}})
    assert page.count("<img ") == page.count('src="data:image/svg+xml;base64,') == 3
    assert "<script" not in page
    assert all(f"<td>T{i}</td><td>{Path(run).name}</td>" in page for i, run in enumerate(runs, start=1))
    assert list(result)[:6] == ISO_13374
    assert result["data_acquisition"]["times_from"] == "given"
    tracked = [each["mean"] for each in result["state_detection"]["forgetting"]["friction"]]
    assert tracked == pytest.approx(FRICTIONS, rel=0.01)
    late = result["state_detection"]["plain"]["friction"][-1]
    assert late["interval90"][1] < FRICTIONS[-1]
    life = result["prognostic_assessment"]["remaining_life"]
    # 0.2 N to go at 0.1 N in 90 h; four points do not rule out that friction saturates before
    assert life["interval90"][0] < 180.0
    assert 90.0 < life["median"] < 360.0
    assert life["interval90"][1] is None
    laws = result["prognostic_assessment"]["laws_of_wear"]
    assert sum(laws.values()) == pytest.approx(1.0)
    assert max(laws, key=laws.get) == "linear"
    assert "may never reach it" in result["advisory_generation"]["text"]
    assert life["unit"] == "h"
    with xr.open_dataset(out / "monitor.nc", engine="h5netcdf") as saved:
        assert saved["friction_mean"].attrs["units"] == "N"
        area = np.trapezoid(saved["remaining_life_density"], saved["remaining"])
    reached = 1.0 - sum(
        result["prognostic_assessment"][f"probability_{p}"] for p in ("reached_already", "never_reached")
    )
    assert float(area) == pytest.approx(reached, abs=0.01)


def test_without_threshold_and_times(
    runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "wear"
    assert main(["monitor", *runs, *SYSTEM, "--out", str(out)]) == 0
    assert "time" not in capsys.readouterr().out.partition("read ")[0]
    result = strict(out / "monitor.json")
    assert result["prognostic_assessment"] is None
    assert result["advisory_generation"]["case"] == "no_threshold"
    assert result["data_acquisition"]["time_unit"] == "detection points"
    assert not (out / "remaining_life.png").exists()


@pytest.mark.parametrize(
    ("discount", "said"),
    [
        (1.0, "all points so far count alike"),
        (0.8, "20 % of what was known from point to point: about 5 points"),
    ],
)
def test_memory_is_reported_in_points(discount: float, said: str) -> None:
    assert said in memory({"discount": discount, "log_predictive": 3.0}, {"log_predictive": 1.0})


def test_fleet_to_report(
    fleet: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    options = ("--threshold", "0.6", "--workers", "1", "--out", str(out))
    assert main(["monitor", str(fleet()), *SYSTEM, *options]) == 0
    assert "3 machines, 4 detection points, 3 records not usable" in capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {
        *("monitor.json", "monitor.nc", "manifest.json", "report.html", "fleet.png", "fleet.pdf")
    }
    result = strict(out / "monitor.json")
    page = unescape((out / "report.html").read_text(encoding="utf-8"))
    assert page.index("<td>p2</td>") < page.index("<td>p1</td>") < page.index("<td>p3</td>")
    assert "All machines are listed below, the shortest remaining life first." in page
    assert page.count("<img ") == 1
    assert list(result) == ISO_13374
    # the second pump wears faster, the third cannot be followed
    assert result["advisory_generation"]["most_urgent_first"] == ["p2", "p1", "p3"]
    assert result["health_assessment"]["machines"][2]["status"] == "too_few_points"
    assert result["prognostic_assessment"][2]["remaining_life"]["median"] is None


BAD: dict[str, tuple[tuple[int, ...], tuple[str, ...], str]] = {
    "one record": ((0,), (), "at least two"),
    "same record twice": ((0, 1, 0), (), "given twice"),
    "times not increasing": ((0, 1), ("--times", "5", "1"), "not after"),
    "too few times": ((0, 1), ("--times", "5"), "1 for 2 records"),
    "time is a word": ((0, 1), ("--times", "1", "soon"), "soon"),
    "unit without times": ((0, 1), ("--time-unit", "h"), "--times"),
    "no such threshold": ((0, 1), ("--threshold", "-0.3"), "--threshold"),
    "threshold is not finite": ((0, 1), ("--threshold", "nan"), "--threshold"),
    "scheduler without fleet": ((0, 1), ("--scheduler", "tcp://localhost:1"), "fleet"),
    "no workers": ((0, 1), ("--workers", "0"), "--workers"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input(kind: str, runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen, options, said = BAD[kind]
    out = tmp_path / "out"
    records = [runs[i] for i in chosen]
    assert said in refused(capsys, "monitor", *records, *SYSTEM, "--out", str(out), *options)
    assert not out.exists()


def test_records_of_different_quantities(
    runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.csv"
    other.write_text(
        Path(runs[0]).read_text().replace("displacement", "velocity").replace("velocity_m", "velocity_m_s")
    )
    line = refused(capsys, "monitor", runs[1], str(other), *SYSTEM, "--out", str(tmp_path / "out"))
    assert "velocity" in line
    assert "run2.csv" in line


def test_a_fleet_goes_alone(
    runs: list[str], fleet: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(capsys, "monitor", runs[0], str(fleet()), *SYSTEM, "--out", str(tmp_path / "out"))
    assert "alone" in line


def test_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["monitor", "--help"])
    assert "usage: friction-bayes monitor" in capsys.readouterr().out


def test_no_folder_is_refused(runs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert "--out" in refused(capsys, "monitor", *runs, *SYSTEM)


@pytest.mark.parametrize(
    ("changes", "options", "said"),
    [
        ({"units": "parsec"}, (), "parsec"),
        ({"units": None}, (), "set its attribute units"),
        ({"quantity": "colour"}, (), "colour"),
        ({"dims": ("machine", "point", "sample")}, (), "time"),
        ({}, ("--times", "1", "2"), "--times"),
    ],
)
def test_bad_fleet(
    changes: dict[str, Any],
    options: tuple[str, ...],
    said: str,
    fleet: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert said in refused(capsys, "monitor", str(fleet(**changes)), *SYSTEM, "--out", str(out), *options)
    assert not out.exists()
