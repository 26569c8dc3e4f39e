"""``friction-bayes close-loop``: what it writes and prints, that runs repeat, how bad input is refused."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import friction_bayes as fb
from decays import PUSHED_UNTIL, pushed_decay, short_decay
from friction_bayes.cli.loop_folder import write_draws
from friction_bayes.cli.program import main

SYSTEM = ("--mass", "10", "--stiffness", "1000")
FRICTION = 0.5
FIELDS = {
    "verdict",
    "effects",
    "candidates",
    "friction_before",
    "friction_after",
    "dry_friction",
    "prior_sensitivity",
    "held_out_error",
    "residual",
    "noise",
    "paper_procedure",
    "next_experiment",
    "reference_check",
    "elapsed_s",
}
FIGURES = {
    f"{name}.svg" for name in ("candidates", "friction", "signal", "residual", "turning_points", "forecast")
}

Signal = tuple[np.ndarray, np.ndarray]


def strict(text: str) -> dict[str, Any]:
    """Parse JSON, refusing NaN and infinities."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} in JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def dragged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A synthetic record with quadratic drag that nothing else can imitate: 0.5 N, 18 half cycles, 100 Hz."""
    record = short_decay(
        friction=FRICTION,
        initial_displacement=0.04,
        duration=6.0,
        noise_sd=2e-5,
        effects={"quadratic_drag.drag_coefficient": 6.0},
        seed=11,
    )
    return fb.write_record(record, tmp_path_factory.mktemp("records") / "dragged.csv")


@pytest.fixture(scope="module")
def closed(dragged: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run."""
    out = tmp_path_factory.mktemp("loop") / "deep" / "loop"
    argv = ("close-loop", str(dragged), *SYSTEM, "--out", str(out), "--seed", "5")
    assert main([*argv, "--reference-friction", str(FRICTION)]) == 0
    return out


def test_report(closed: Path) -> None:
    report = strict((closed / "report.json").read_text())
    assert set(report) >= FIELDS
    assert report["verdict"] == "explained"
    assert [effect["name"] for effect in report["effects"]] == ["quadratic_drag"]
    assert report["candidates"][0]["effects"] == ["quadratic_drag"]
    assert sum(c["probability"] for c in report["candidates"]) == pytest.approx(1.0)
    after, before = report["friction_after"], report["friction_before"]
    assert set(after) == set(before) == {"mean", "sd", "interval90", "unit"}
    # 5 sd: a false alarm in two million
    assert abs(after["mean"] - FRICTION) < 5.0 * after["sd"]
    assert abs(before["mean"] - FRICTION) > 0.1
    assert report["held_out_error"]["after"] < 0.3 * report["held_out_error"]["before"]
    assert report["reference_check"]["friction"] == FRICTION
    assert report["reference_check"]["error_after"] == pytest.approx(after["mean"] / FRICTION - 1.0)


def test_folder(closed: Path, dragged: Path) -> None:
    manifest = strict((closed / "manifest.json").read_text())
    on_disk = {path.name for path in closed.iterdir()}
    assert on_disk == FIGURES | {"report.json", "report.html", "posterior.nc", "manifest.json"}
    assert on_disk == {*manifest["files"], "manifest.json"}
    assert manifest["seed"] == 5
    assert [entry["record"] for entry in manifest["inputs"]] == [str(dragged)]
    assert [path.name for path in closed.parent.iterdir()] == ["loop"]
    page = (closed / "report.html").read_text()
    assert page.count("data:image/svg+xml;base64,") == 6
    assert "with quadratic drag explains the record" in page
    with xr.open_datatree(closed / "posterior.nc", engine="h5netcdf") as tree:
        draws = np.ravel(tree["mixture"]["friction"].values)
        # numbered, without which ArviZ does not draw a trace
        assert tree["mixture"]["draw"].values.tolist() == list(range(draws.size))
    report = strict((closed / "report.json").read_text())
    assert draws.mean() == pytest.approx(report["friction_after"]["mean"])


@pytest.mark.skipif(find_spec("arviz") is None, reason="the extra arviz is not installed")
def test_check_keeps_what_was_sampled(dragged: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # whatever that is: each step integrates the motion
    monkeypatch.setattr("friction_bayes.loop.checks.sampler_check._MOST_STEPS", 150)
    out = tmp_path / "loop"
    options = ("--effects", "quadratic_drag", "--check", "--out", str(out))
    assert main(["close-loop", str(dragged), *SYSTEM, *options]) == 0
    assert {"ranks.svg", "ess.svg"} <= {path.name for path in out.iterdir()}
    sampler = strict((out / "report.json").read_text())["reference_check"]["sampler"]
    with xr.open_datatree(out / "posterior.nc", engine="h5netcdf") as tree:
        reference = tree["reference"].load()
    assert reference.attrs["nested_rhat"] == sampler["rhat"]
    assert {"posterior", "sample_stats", "log_likelihood"} <= set(reference.children)
    assert reference["posterior"].sizes["chain"] == sampler["ensembles"]
    assert "walker" in reference["posterior"].coords


def test_draws_are_written_as_xarray_writes_them(tmp_path: Path, rng: np.random.Generator) -> None:
    draws = rng.standard_normal((1, 7))
    tree = xr.DataTree.from_dict(
        {
            "posterior": xr.Dataset(
                {"friction": (("chain", "draw"), draws)},
                coords={"chain": np.arange(1), "draw": np.arange(7)},
                attrs={"seed": 3},
            ),
            "mixture": xr.Dataset(
                {
                    "friction": (("chain", "draw"), draws[:, :5], {"units": "N"}),
                    "candidate": (("chain", "draw"), np.arange(5)[None]),
                }
            ),
        }
    )
    write_draws(tree, tmp_path / "own.nc")
    tree.to_netcdf(tmp_path / "xarray.nc", engine="h5netcdf")
    own, theirs = everything_in(tmp_path / "own.nc"), everything_in(tmp_path / "xarray.nc")
    assert "/mixture/candidate" in own
    np.testing.assert_equal(own, theirs)


def everything_in(path: Path) -> dict[str, Any]:
    """Type, values and attributes of all that an HDF5 file holds, by name; of references, that they exist."""
    found: dict[str, Any] = {}

    def look(name: str, item: Any) -> None:
        values = (item.dtype, item[...]) if isinstance(item, h5py.Dataset) else None
        references = ("DIMENSION_LIST", "REFERENCE_LIST")
        reported = {key: None if key in references else value for key, value in item.attrs.items()}
        found[f"/{name}"] = (values, reported)

    with h5py.File(path) as file:
        look("", file)
        file.visititems(look)
    return found


def test_same_seed_same_bits(
    closed: Path, dragged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ("close-loop", str(dragged), *SYSTEM, "--out", str(tmp_path / "again"), "--seed", "5", "--json")
    assert main([*argv, "--reference-friction", str(FRICTION)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    again, first = strict(shown.out), strict((closed / "report.json").read_text())
    assert again == strict((tmp_path / "again" / "report.json").read_text())
    again.pop("elapsed_s")
    first.pop("elapsed_s")
    assert again == first
    for name in ("report.html", "signal.svg", "candidates.svg"):
        assert (tmp_path / "again" / name).read_bytes() == (closed / name).read_bytes()


def test_both_forces_where_the_declared_system_swings_otherwise(csv: Path) -> None:
    system = fb.Oscillator(mass=10.0, stiffness=900.0)
    report = fb.close_loop([fb.read_record(csv)], system, seed=1, effects=("viscous_damping",))
    found = report.frequency
    assert found["mean"] == pytest.approx(10.0, rel=1e-3)
    assert found["declared"] == pytest.approx(np.sqrt(90.0))
    # r/k is 0.5 mm, whatever the declared system
    assert found["from_stiffness"] == pytest.approx(900.0 * 5e-4, rel=0.01)
    assert found["from_mass"] == pytest.approx(10.0 * 100.0 * 5e-4, rel=0.01)
    low, high = report.friction_after["interval90"]
    assert low < 0.451
    assert high > 0.499
    trusting = replace(system, trust="mass")
    trusted = fb.close_loop([fb.read_record(csv)], trusting, seed=1, effects=("viscous_damping",))
    assert trusted.friction_after["mean"] == pytest.approx(0.5, rel=0.01)
    assert trusted.friction_after["sd"] < 0.01


@pytest.mark.usefixtures("without_loop_folder")
def test_table_of_a_clipped_and_offset_record(
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    time, signal = decay(duration=4.0)
    record = write_csv("clipped.csv", time, np.clip(signal + 2e-3, -0.02, 0.018), "displacement_m")
    argv = ("close-loop", str(record), *SYSTEM, "--noise", "white", "--exclude", "asymmetric_friction")
    assert main([*argv, "--out", str(tmp_path / "loop")]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    for row in (
        r".*clipped\.csv",
        r"verdict +[A-Z]+( which effect, friction is agreed on)?: .*sensor offset \+ sensor",
        r"friction before +0\.\d+ N ",
        r"friction after +0\.[45]\d* N ",
        r"effects +sensor offset .* offset 0\.00[12]",
        r" +sensor clipping +> 99\.\d % +level 0\.018 ",
        r"held-out error +[\d.e-]+ m before, ",
        r"residual before +RMS [\d.e-]+ m; ",
        r"residual after +RMS [\d.e-]+ m; ",
        r"sensor noise +sd [\d.e-]+ m, white\n",
        r"paper's procedure +no result: clipped: ",
    ):
        assert re.search(f"^{row}", shown.out, re.MULTILINE), row


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """Run a command that must be refused, and return its one line."""
    status = main(["close-loop", *argv])
    shown = capsys.readouterr()
    assert status == 2, shown.err
    assert shown.out == ""
    (line,) = shown.err.splitlines()
    return line


OPTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "unknown effect": (("--effects", "magic"), ("magic", "viscous_damping")),
    "unknown excluded effect": (("--exclude", "magic"), ("magic", "viscous_damping")),
    "effects and exclude": (
        ("--effects", "viscous_damping", "--exclude", "friction_drift"),
        ("--exclude", "--effects"),
    ),
    "empty name": (("--effects", "viscous_damping,"), ("--effects", "empty")),
    "noise": (("--noise", "pink"), ("pink", "auto, white, ar")),
    "seed": (("--seed", "-1"), ("--seed", "-1")),
    "seed that is no number": (("--seed", "x"), ("--seed", "'x'")),
    "negative reference": (("--reference-friction", "-1"), ("--reference-friction", "-1")),
    "reference that is none": (("--reference-friction", "nan"), ("--reference-friction", "nan")),
    "two references": (
        ("--reference-friction", "1", "--reference-force", "f.csv"),
        ("--reference-force", "--reference-friction"),
    ),
    "no reference file": (("--reference-force", "nowhere.csv"), ("nowhere.csv", "no such file")),
}


@pytest.mark.parametrize("case", OPTIONS)
def test_bad_option(case: str, csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options, words = OPTIONS[case]
    line = refused(capsys, str(csv), *SYSTEM, "--out", str(tmp_path / "loop"), *options)
    for word in words:
        assert word in line
    assert [path.name for path in tmp_path.iterdir()] == ["decay.csv"]


def test_no_folder_named(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--out" in refused(capsys, str(csv), *SYSTEM)


def test_folder_is_not_overwritten(csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "loop"
    out.mkdir()
    (out / "mine.txt").write_text("keep")
    assert "--force" in refused(capsys, str(csv), *SYSTEM, "--out", str(out))
    assert [path.name for path in out.iterdir()] == ["mine.txt"]


def test_records_that_do_not_belong_together(
    csv: Path,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    time, signal = decay()
    velocity = write_csv("velocity.csv", time, 10.0 * signal, "velocity_m_s")
    holed = write_csv("holed.csv", time, np.where(time == 2.0, np.nan, signal), "displacement_m")
    out = ("--out", str(tmp_path / "loop"))
    line = refused(capsys, str(csv), str(velocity), *SYSTEM, *out)
    assert "velocity.csv" in line
    assert "decay.csv" in line
    assert "given twice" in refused(capsys, str(csv), str(csv), *SYSTEM, *out)
    line = refused(capsys, str(csv), str(holed), *SYSTEM, *out)
    assert "holed.csv" in line
    assert "nan" in line
    assert "--stiffness" in refused(capsys, str(csv), "--mass", "10", *out)
    assert not (tmp_path / "loop").exists()


def test_systems_that_differ(
    csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def measured(name: str) -> tuple[xr.DataArray, fb.Oscillator]:
        return fb.read_record(csv), fb.Oscillator(mass=10.0, stiffness={"a": 1000.0, "b": 900.0}[name])

    monkeypatch.setattr(fb, "dataset_record", measured)
    line = refused(capsys, "dataset:a", "dataset:b", "--out", str(tmp_path / "loop"))
    assert "dataset:b: is of another system than dataset:a" in line


FORCES: dict[str, tuple[str, str]] = {
    "no such column": ("time_s,pressure\n0,1\n5,1\n", "force_N"),
    "short": ("time_s,force_N\n0,1\n2,1\n", "covers 0 to 2 s"),
    "rows": ("force_N\n1\n1\n", "has 2 rows, the record 500"),
    "times": ("time_s,force_N\n0,1\n3,1\n2,1\n5,1\n", "do not rise"),
    "stamps": (
        "time,force_N\n10:00:00,1\n10:00:05,1\n",
        "its times begin at 10:00:00, those of the record do not",
    ),
    "nan": ("time_s,force_N\n0,1\n3,nan\n5,1\n", "row 3"),
}


@pytest.mark.parametrize("case", FORCES)
def test_bad_reference_force(
    case: str, csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = FORCES[case]
    force = tmp_path / "force.csv"
    force.write_text(text)
    line = refused(
        capsys, str(csv), *SYSTEM, "--out", str(tmp_path / "loop"), "--reference-force", str(force)
    )
    assert "force.csv" in line
    assert words in line


@pytest.mark.usefixtures("without_loop_figures")
def test_a_hand_at_the_release_is_cut_and_reported(
    write_csv: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    record = pushed_decay()
    path = write_csv("pushed.csv", record["time"].values, record.values, "displacement_m")
    options = ("--effects", "viscous_damping", "--random-force", "none", "--json")
    main(["close-loop", str(path), *SYSTEM, "--out", str(tmp_path / "out"), *options])
    report = strict(capsys.readouterr().out)
    (cut,) = report["notes"]
    assert "held or touched at first" in cut
    assert report["fitted"]["from_s"] > PUSHED_UNTIL
    assert report["friction_after"]["mean"] == pytest.approx(0.25, rel=0.01)
    assert cut in html.unescape((tmp_path / "out" / "report.html").read_text())
