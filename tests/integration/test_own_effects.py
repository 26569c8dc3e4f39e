"""``--register MODULE:EFFECT``: an effect of one's own joins the catalogue; anything else is refused."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.cli.program import main
from friction_bayes.estimators.registry import ESTIMATORS
from friction_bayes.mechanics import extras
from friction_bayes.mechanics.effects import EFFECTS

MODULE = """
from friction_bayes.mechanics.effects import Parameter, SensorEffect
from friction_bayes.mechanics.effects.prior import normal


def saturate(signal, time, saturation):
    return signal - saturation * signal**3


SATURATION = SensorEffect(
    name="sensor_saturation",
    summary="- s x^3",
    parameters=(Parameter(name="saturation", unit="1/(signal)2", prior=lambda scales: normal(0.1)),),
    distort=saturate,
)
"""
ESTIMATOR = """
from friction_bayes.estimators.envelope.estimator import EnvelopeEstimator

USUAL = EnvelopeEstimator()


class OwnEnvelope:
    name = "own-envelope"
    prior_keys = USUAL.prior_keys
    default_prior = USUAL.default_prior
    fit = USUAL.fit
    fit_many = USUAL.fit_many


OWN = OwnEnvelope()
"""
MOTION = (
    *("--mass", "10", "--stiffness", "1000", "--friction", "0.5", "--initial-displacement", "0.02"),
    *("--sampling-rate", "100", "--duration", "5"),
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The current folder, with a module of an effect and one that cannot be imported."""
    (tmp_path / "own_sensor.py").write_text(MODULE)
    (tmp_path / "own_estimator.py").write_text(ESTIMATOR)
    (tmp_path / "broken_sensor.py").write_text("1 / 0\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield tmp_path
    EFFECTS.pop("sensor_saturation", None)
    ESTIMATORS.pop("own-envelope", None)
    for name in ("own_sensor", "own_estimator"):
        sys.modules.pop(name, None)


def test_an_effect_of_ones_own_acts_like_one_of_the_catalogue(folder: Path) -> None:
    own = ("--register", "own_sensor:SATURATION", "--effect", "sensor_saturation.saturation=300")
    assert main(["simulate", *MOTION, "--out", "plain.csv"]) == 0
    for name in ("saturated.csv", "again.csv"):  # registered a second time it is the same
        assert main(["simulate", *MOTION, *own, "--out", name]) == 0
    plain, saturated = (fb.read_record(folder / name).values for name in ("plain.csv", "saturated.csv"))
    np.testing.assert_allclose(saturated, plain - 300.0 * plain**3, atol=1e-8)


def test_an_estimator_of_ones_own_is_a_method(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", *MOTION, "--out", "plain.csv"]) == 0
    own = ("--register", "own_estimator:OWN", "--method", "own-envelope")
    found = []
    for method in (("--method", "envelope"), own):
        assert main(["estimate", "plain.csv", *MOTION[:4], *method, "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert found[1]["method"] == "own-envelope"
    assert found[1]["friction"] == found[0]["friction"]


@pytest.mark.parametrize("name", extras.__all__)
def test_effects_that_come_with_the_package_are_asked_for(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    effect = getattr(extras, name)
    assert effect.name not in EFFECTS
    # registered and not used: using it compiles the integrator anew
    known = ("--register", f"friction_bayes.mechanics.extras:{name}", "--effect", f"{effect.name}.nothing=1")
    try:
        assert main(["simulate", *MOTION, *known, "--out", "plain.csv"]) == 2
        asked = f"unknown parameter 'nothing'; give {effect.parameters[0].name}"
        assert f"effect {effect.name}: {asked}" in capsys.readouterr().err
    finally:
        del EFFECTS[effect.name]


def test_where_an_effect_plays_no_part_it_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", *MOTION, "--out", "plain.csv"]) == 0
    own = ("--register", "own_sensor:SATURATION", "--method", "envelope")
    assert main(["estimate", "plain.csv", *MOTION[:4], *own]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "warning sensor_saturation plays no part: estimate fits dry friction alone; close-loop" in said


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("own_sensor", "'own_sensor' is not MODULE:EFFECT; write it like"),
        ("nowhere:SATURATION", "nowhere cannot be imported (ModuleNotFoundError"),
        (
            "broken_sensor:SATURATION",
            "broken_sensor cannot be imported (ZeroDivisionError: division by zero)",
        ),
        ("own_sensor:saturate", "saturate of own_sensor is no effect"),
        ("own_sensor:LOST", "LOST of own_sensor is no effect"),
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
    assert "sensor_saturation" not in EFFECTS
