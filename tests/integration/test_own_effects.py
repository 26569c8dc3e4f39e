"""``--register MODULE:EFFECT``: an effect of one's own is one of the catalogue; what is none is refused."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.cli.program import main
from friction_bayes.mechanics.effects import EFFECTS

MODULE = """
from friction_bayes.mechanics.effects import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal


def bend(signal, time, curvature):
    return signal + curvature * signal**2


BEND = SensorEffect(
    name="sensor_curvature",
    summary="+ c y^2",
    parameters=(Parameter(name="curvature", unit="1/signal", prior=lambda scales: normal(0.1)),),
    distort=bend,
)
"""
MOTION = (
    *("--mass", "10", "--stiffness", "1000", "--friction", "0.5", "--initial-displacement", "0.02"),
    *("--sampling-rate", "100", "--duration", "5"),
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The current folder, with a module of an effect and one that cannot be imported."""
    (tmp_path / "bent_sensor.py").write_text(MODULE)
    (tmp_path / "broken_sensor.py").write_text("1 / 0\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield tmp_path
    EFFECTS.pop("sensor_curvature", None)
    sys.modules.pop("bent_sensor", None)


def test_an_effect_of_ones_own_acts_like_one_of_the_catalogue(folder: Path) -> None:
    own = ("--register", "bent_sensor:BEND", "--effect", "sensor_curvature.curvature=3")
    assert main(["simulate", *MOTION, "--out", "plain.csv"]) == 0
    for name in ("bent.csv", "again.csv"):  # registered a second time it is the same
        assert main(["simulate", *MOTION, *own, "--out", name]) == 0
    plain, bent = (fb.read_record(folder / name).values for name in ("plain.csv", "bent.csv"))
    np.testing.assert_allclose(bent, plain + 3.0 * plain**2, atol=1e-8)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("bent_sensor", "'bent_sensor' is not MODULE:EFFECT; write it like"),
        ("nowhere:BEND", "nowhere cannot be imported (ModuleNotFoundError"),
        ("broken_sensor:BEND", "broken_sensor cannot be imported (ZeroDivisionError: division by zero)"),
        ("bent_sensor:bend", "bend of bent_sensor is no effect"),
        ("bent_sensor:LOST", "LOST of bent_sensor is no effect"),
    ],
)
def test_what_is_no_effect_is_refused(
    entry: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (
        ("simulate", *MOTION, "--out", "x.csv"),
        ("close-loop", "x.csv", *MOTION[:4], "--out", "loop"),
    ):
        assert main([*command, "--register", entry]) == 2
        said = capsys.readouterr().err
        assert f"friction-bayes: --register: {words}" in said
        assert said.count("\n") == 1
    assert "sensor_curvature" not in EFFECTS
