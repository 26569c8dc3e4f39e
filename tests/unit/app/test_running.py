"""A command in a process of its own: what it says, what it complains of, and its end."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from friction_bayes.app.running import Run
from friction_bayes.cli.console import note, progress_bar
from friction_bayes.cli.program import main
from friction_bayes.core.progress import PROGRESS

SPRING = ("--mass", "10", "--stiffness", "1000")


def ended(run: Run) -> str:
    until = time.monotonic() + 60.0
    while run.going_on and time.monotonic() < until:
        time.sleep(0.05)
    return run.problem()


def test_complaints_and_stops(tmp_path: Path) -> None:
    (tmp_path / "decay.csv").write_text("time_s,displacement_m\n0,oops\n")
    # a module of the folder must not shadow one of Python's
    (tmp_path / "numpy.py").write_text("raise SystemExit(3)")
    refused = Run(["estimate", "decay.csv", *SPRING], tmp_path)
    stopped = Run(["simulate", *SPRING, "--friction", "0.07", "--out", "decay.nc"], tmp_path)
    stopped.stop()
    assert ended(stopped) == "stopped before there was an answer"
    assert ended(refused).startswith("decay.csv: row 2")
    assert " s, friction-bayes: decay.csv" in refused.progress


def test_progress_in_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv(PROGRESS, "lines")
    with progress_bar() as bar:
        task = bar.add_task("reading", total=None)
        bar.update(task, description="viscous damping", completed=3)
        bar.update(task, completed=4, total=9)
        bar.advance(task)
    note("done")
    assert capsys.readouterr().err.splitlines() == [
        "step 3: viscous damping",
        "step 4 of 9: viscous damping",
        "step 5 of 9: viscous damping",
        "done",
    ]


def test_without_the_extra_it_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "panel", None)
    assert main(["app"]) == 2
    remedy = 'panel, which is not installed; install it with pip install ".[app]" in the checkout'
    assert remedy in capsys.readouterr().err
    assert main(["app", "--port", "70000"]) == 2
    assert "'70000' is not a port" in capsys.readouterr().err
