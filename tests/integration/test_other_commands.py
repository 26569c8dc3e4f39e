"""``simulate``, ``datasets`` and ``demo``."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import friction_bayes as fb
from decays import short_decay
from friction_bayes.cli import demonstration
from friction_bayes.cli.console import output_console
from friction_bayes.cli.demonstration import Case
from friction_bayes.cli.program import main
from friction_bayes.mechanics.testbed import PAPER_SYSTEM
from friction_bayes.plotting import save_figure

SYSTEM = ("--mass", "10", "--stiffness", "1000")


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out.strip() == f"friction-bayes {fb.__version__}"


@pytest.mark.parametrize("command", [(), ("estimate",), ("simulate",), ("demo",), ("datasets", "get")])
def test_help(command: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--help"])
    assert "usage: friction-bayes" in capsys.readouterr().out


@pytest.mark.parametrize("suffix", [".csv", ".nc"])
def test_simulate_writes_what_python_simulates(suffix: str, tmp_path: Path) -> None:
    target = tmp_path / f"decay{suffix}"
    options = (
        *("--friction", "0.5", "--initial-displacement", "0.02", "--duration", "4", "--sampling-rate", "100"),
        *("--noise-sd", "1e-4", "--seed", "5", "--effect", "sensor_offset.offset=1e-3"),
    )
    assert main(["simulate", *SYSTEM, *options, "--out", str(target)]) == 0
    written = fb.read_record(target)
    expected = short_decay(duration=4.0, seed=5, effects={"sensor_offset.offset": 1e-3})
    assert written.attrs["synthetic"] is True
    assert written.attrs["quantity"] == "displacement"
    assert (written.values == expected.values).all()


def test_simulated_default_comes_to_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "decay.csv"
    assert main(["simulate", *SYSTEM, "--friction", "0.5", "--noise-sd", "1e-4", "--out", str(target)]) == 0
    assert main(["estimate", str(target), *SYSTEM, "--method", "envelope", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["friction"]["mean"] == pytest.approx(0.5, rel=0.01)
    assert "the record is synthetic" in result["notes"]


@pytest.mark.parametrize(
    ("line", "completed"),
    [
        ("estimate x.csv --meth", ["--method"]),
        ("estimate x.csv --method w", ["waveform"]),
        ("close-loop x.csv --exclude friction_d", ["friction_drift"]),
    ],
)
def test_a_shell_is_given_how_a_line_goes_on(
    line: str, completed: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", "bash"]) == 0
    assert "complete " in capsys.readouterr().out
    line = f"friction-bayes {line}"
    asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line))}
    reported = tmp_path / "reported"
    asked["_ARGCOMPLETE_STDOUT_FILENAME"] = str(reported)
    subprocess.run([sys.executable, "-m", "friction_bayes"], env=os.environ | asked, check=True)
    assert reported.read_text().split() == completed


def test_datasets_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["datasets", "list"]) == 0
    shown = capsys.readouterr().out
    known = fb.list_datasets()
    assert "map-single-pendulum" in {data_set.name for data_set in known}
    for data_set in known:
        assert f"dataset:{data_set.name}" in shown
        assert data_set.licence in shown
    assert not any(line.endswith(" ") for line in shown.splitlines())


def test_a_locale_without_the_sign_costs_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    page = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr("sys.stdout", page)
    output_console().print("10 ± 0.1 rad/s")
    page.seek(0)
    assert page.read() == "10 ? 0.1 rad/s\n"


@pytest.mark.usefixtures("without_loop_figures")
def test_demo_compares_and_closes_the_loop_with_the_further_release(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    first, further = (
        fb.simulate(
            PAPER_SYSTEM,
            friction=0.07,
            initial_displacement=size,
            duration=8.0,
            sampling_rate=100.0,
            noise_sd=2e-4,
            effects={"viscous_damping.damping_ratio": 0.002},
            seed=seed,
            name=f"release {seed}",
        )
        for seed, size in ((1, 0.0147), (2, 0.0074))
    )
    case = Case(
        name="damped",
        title="With damping",
        record=first,
        system=PAPER_SYSTEM,
        friction=0.07,
        remark="What to see.",
        further=further,
    )
    monkeypatch.setattr(demonstration, "_cases", lambda seed: (case,))
    monkeypatch.setattr(demonstration, "METHODS", ("waveform", "normal-gamma"))
    # with a few effects: that all of them are evaluated is tested where the loop is
    few = ("viscous_damping", "friction_drift", "sensor_offset", "random_force")
    monkeypatch.setattr(demonstration.fb, "close_loop", partial(fb.close_loop, effects=few))
    # in one format: that figures are written in both is tested where they are
    monkeypatch.setattr(demonstration, "save_figure", partial(save_figure, formats=("png",)))
    out = tmp_path / "demo"
    assert main(["demo", "--out", str(out)]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "With damping; true friction 0.07 N" in shown.out
    # not that of a "Bayes factor"
    assert len(re.findall(r"\byes\b", shown.out)) == 2
    assert "What to see." in shown.out
    names = {path.name for path in out.iterdir()}
    figures = {f"damped_{kind}.png" for kind in ("fit", "amplitudes", "joint", "estimators", "posteriors")}
    assert {"demo.json", "manifest.json", *figures} <= names
    estimates = json.loads((out / "demo.json").read_text())["damped"]["estimates"]
    assert [each["method"] for each in estimates] == ["waveform", "normal-gamma"]
    assert all(each["reference"]["agrees"] for each in estimates)
    said = shown.out
    alone, together = said[said.index("The loop closed on release 1") :].split("The same with a release")
    for part in (alone, together):
        assert "reference" in part
        assert "% before" in part
    assert "viscous damping" in together
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Closing the loop on release 1 and release 2" in page
    assert json.loads((out / "report.json").read_text())["reference_check"]["friction"] == 0.07
