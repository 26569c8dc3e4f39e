"""The page's request, as a command line and as Python lines: the two do the same."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.app.request import Request
from friction_bayes.cli.program import main
from friction_bayes.core.errors import InputError

SPRING = {"mass": SYSTEM.mass, "stiffness": SYSTEM.stiffness, "mass_sd": None, "stiffness_sd": 20.0}


def request(**changed: Any) -> Request:
    usual = {
        "file": "a decay.csv",
        "reading": {"start": 0.25},
        "system": "mass on a spring",
        "values": SPRING,
        "command": "estimate",
    }
    return Request(**(usual | changed))


def test_both_ways_give_the_same_friction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    # figures of an estimate are drawn, and looked at, elsewhere
    monkeypatch.setattr(
        "friction_bayes.plotting.write_figures", lambda figures, *_: dict.fromkeys(figures, b"")
    )
    fb.write_record(short_decay(duration=5.0, seed=2), "a decay.csv")
    asked = request()
    assert asked.command_line().startswith("friction-bayes estimate 'a decay.csv' --mass 10.0 --stiffness")
    program, *arguments = shlex.split(asked.command_line())
    assert program == "friction-bayes"
    assert main(arguments) == 0
    found = json.loads((tmp_path / asked.folder / "estimate.json").read_text())["friction"]["mean"]
    lines: dict[str, Any] = {}
    exec(asked.python(), lines)
    assert float(lines["estimate"].friction.mean()) == found


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"file": "-x.csv"}, "estimate ./-x.csv "),
        ({"file": "dataset:x.csv"}, "estimate ./dataset:x.csv "),
        ({"reading": {"start": -1e-7}}, "--start=-1e-07 "),
        ({"reading": {"signal_column": "a; rm b"}}, "--signal-column 'a; rm b'"),
        ({"command": "close-loop"}, "close-loop 'a decay.csv'"),
    ],
)
def test_nothing_is_taken_for_something_else(changed: dict[str, Any], words: str) -> None:
    assert words in request(**changed).command_line()


def test_a_pendulum_of_a_length_is_one_of_inertia_and_stiffness() -> None:
    asked = request(system="mass on a string or rod", values={"mass": 0.2, "length": 0.5})
    assert "fb.Pendulum(mass=0.2, length=0.5)" in asked.python()
    declared = fb.Pendulum(mass=0.2, length=0.5)
    reported = f"--inertia {declared.inertia} --stiffness {declared.stiffness} --start 0.25 --pendulum"
    assert reported in asked.command_line()


def test_what_is_missing_is_asked_for() -> None:
    with pytest.raises(InputError, match=r"stiffness: is not given, .* enter it in N/m"):
        request(values=SPRING | {"stiffness": None}).arguments()
    with pytest.raises(InputError, match="mass: -1 is not positive"):
        request(values=SPRING | {"mass": -1.0}).arguments()
