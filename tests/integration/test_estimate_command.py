"""``friction-bayes estimate`` on good records: what it prints, what it writes, and that both are right."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import friction_bayes as fb
from decays import SYSTEM as OSCILLATOR
from friction_bayes.cli.program import main
from friction_bayes.core.files import sha256_of
from friction_bayes.core.quantities import STANDARD_GRAVITY

SYSTEM = ("--mass", "10", "--stiffness", "1000")
FRICTION = 0.5
SUMMARY = {"mean", "sd", "interval90", "unit"}
METHODS = ("waveform", "envelope", "normal-gamma", "gamma-exponential")

Signal = tuple[np.ndarray, np.ndarray]


def strict(text: str) -> dict[str, Any]:
    """Parse JSON, refusing NaN and infinities."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} in JSON")

    return json.loads(text, parse_constant=refuse)


def run_json(capsys: pytest.CaptureFixture[str], *argv: str) -> dict[str, Any]:
    status = main([*argv, "--json"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    assert shown.err == ""
    return strict(shown.out)


def check_summary(summary: dict[str, Any], unit: str) -> None:
    assert set(summary) == SUMMARY
    assert summary["unit"] == unit
    low, high = summary["interval90"]
    assert low < summary["mean"] < high


@pytest.mark.parametrize("method", METHODS)
def test_json_as_promised(method: str, csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", method)
    promised = {
        "method",
        "friction",
        "friction_over_stiffness",
        "precision",
        "accepted",
        "acceptance",
        "amplitudes",
        "reference",
    }
    assert promised <= set(result)
    assert result["method"] == method
    check_summary(result["friction"], "N")
    check_summary(result["friction_over_stiffness"], "m")
    if method == "gamma-exponential":
        assert result["precision"] is None
    else:
        check_summary(result["precision"], result["precision"]["unit"])
    assert result["accepted"] is None
    assert result["acceptance"] is None
    assert result["reference"] is None
    assert isinstance(result["amplitudes"], int)
    assert result["includes_system_uncertainty"] is False
    assert any("taken as exact" in text for text in result["notes"])


@pytest.mark.parametrize("method", METHODS[:3])
def test_friction_is_found(method: str, csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    friction = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", method)["friction"]
    # 6 sd: a false alarm in 1e8 for a normal; the paper's interval is wider than its error anyway.
    assert abs(friction["mean"] - FRICTION) < 6.0 * friction["sd"]
    assert friction["mean"] == pytest.approx(FRICTION, rel=0.1)


def test_command_and_python_say_the_same(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", "envelope")
    estimate = fb.estimate(fb.read_record(csv), OSCILLATOR, method="envelope")
    assert printed == strict(json.dumps(estimate.to_dict(), allow_nan=False))
    assert printed["friction"]["mean"] == estimate.friction.mean()
    assert estimate.friction_over_stiffness.mean() * 1000.0 == pytest.approx(estimate.friction.mean())


def test_stiffness_sd_widens_the_interval(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exact = run_json(capsys, "estimate", str(csv), *SYSTEM)
    vague = run_json(capsys, "estimate", str(csv), *SYSTEM, "--stiffness-sd", "50")
    assert vague["includes_system_uncertainty"] is True
    relative = vague["friction"]["sd"] / vague["friction"]["mean"]
    assert relative == pytest.approx(
        np.hypot(0.05, exact["friction"]["sd"] / exact["friction"]["mean"]), rel=1e-3
    )
    assert vague["friction_over_stiffness"] == exact["friction_over_stiffness"]


def test_a_pendulum_is_declared_by_its_length(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_length = ("--length", "1.2", "--mass", "0.4")
    decay = tmp_path / "pendulum.csv"
    simulated = (
        "--friction",
        "0.003",
        "--initial-displacement",
        "0.2",
        "--duration",
        "20",
        "--noise-sd",
        "1e-4",
    )
    assert main(["simulate", *by_length, *simulated, "--out", str(decay)]) == 0
    capsys.readouterr()
    found = run_json(capsys, "estimate", str(decay), *by_length)
    low, high = found["friction"]["interval90"]
    assert low < 0.003 < high
    inertia, stiffness = 0.4 * 1.2**2, 0.4 * STANDARD_GRAVITY * 1.2
    same = ("--inertia", repr(inertia), "--stiffness", repr(stiffness), "--pendulum")
    assert run_json(capsys, "estimate", str(decay), *same)["friction"] == found["friction"]


def test_the_papers_prior(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--method", "normal-gamma", "--prior", "mu=0.1", "lam=0.01", "--prior", "alpha=1", "beta=0.02")
    result = run_json(capsys, "estimate", str(csv), *SYSTEM, *options)
    assert result["prior"] == {"mu": 0.1, "lam": 0.01, "alpha": 1.0, "beta": 0.02}
    prior = fb.NormalGamma(mu=0.1, lam=0.01, alpha=1.0, beta=0.02)
    estimate = fb.estimate(fb.read_record(csv), OSCILLATOR, method="normal-gamma", prior=prior)
    assert estimate.friction.mean() == result["friction"]["mean"]


def test_wrong_mass_is_reported(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_json(capsys, "estimate", str(csv), "--mass", "13", "--stiffness", "1000")
    (text,) = [text for text in result["notes"] if "swings at" in text]
    # r = k d = 0.5 N; m w^2 d = 13 * 100 * 5e-4 = 0.65 N
    assert "declared stiffness" in text
    assert "0.65" in text
    assert "swings at 1.59" in text
    assert "imply 1.3959 Hz" in text
    assert "check mass, stiffness and their units" in text
    assert result["frequency"]["mean"] == pytest.approx(10.0, rel=1e-3)
    assert result["frequency"]["declared"] == pytest.approx(np.sqrt(1000.0 / 13.0))


@pytest.mark.parametrize("unit", ["V", "a.u."])
def test_uncalibrated_signal(
    unit: str,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    time, signal = decay()
    record = write_csv("raw.csv", time, 40.0 * signal, "sensor")
    options = (
        "--signal-column",
        "sensor",
        "--quantity",
        "displacement",
        "--unit",
        unit,
        "--method",
        "envelope",
    )
    result = run_json(capsys, "estimate", str(record), *SYSTEM, *options)
    check_summary(result["friction"], unit)
    assert result["friction"]["mean"] == pytest.approx(40.0 * 5e-4, rel=0.05)
    assert any("not calibrated" in text for text in result["notes"])


def test_a_run_of_several(csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Runs side by side, as PASCO Capstone exports them, say the same as the run in a file of its own."""
    rows = [f"{line};0;1".replace(",", ";") for line in csv.read_text().splitlines()[1:]]
    rows[300:] = [row.replace(";0;1", ";;") for row in rows[300:]]
    header = '"Time (s) Run #2";"Position (m) Run #2";"Time (s) Run #3";"Position (m) Run #3"'
    runs = tmp_path / "runs.csv"
    runs.write_text("\n".join([header, *rows]).replace(".", ","), encoding="utf-8-sig")
    chosen = run_json(capsys, "estimate", str(runs), *SYSTEM, "--method", "envelope", "--run", "2")
    alone = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", "envelope")
    assert chosen["friction"] == alone["friction"]


def test_threshold(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ("estimate", str(csv), *SYSTEM, "--method", "normal-gamma")
    precision = run_json(capsys, *common)["precision"]["mean"]
    lenient = run_json(capsys, *common, "--accept-precision", str(0.9 * precision))
    severe = run_json(capsys, *common, "--accept-precision", str(1.1 * precision))
    assert lenient["accepted"] is True
    assert severe["accepted"] is False
    assert severe["acceptance"]["threshold"] == pytest.approx(1.1 * precision)
    assert "falls short" in severe["acceptance"]["because"]


@pytest.mark.parametrize(("noise_sd", "accepted"), [(1e-4, True), (1e-3, False)])
def test_set_up_record(
    noise_sd: float,
    accepted: bool,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    long = write_csv("setup.csv", *decay(amplitude=0.06, duration=17.0), "displacement_m")
    short = write_csv("short.csv", *decay(duration=4.0, noise_sd=noise_sd), "displacement_m")
    result = run_json(capsys, "estimate", str(short), *SYSTEM, "--method", "envelope", "--setup", str(long))
    assert result["accepted"] is accepted, result["acceptance"]
    assert result["acceptance"]["criterion"] == "set-up record"
    assert result["acceptance"]["set_up_precision"] > 0.0


def test_results_folder(
    csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    out = tmp_path / "deep" / "results"
    argv = (
        "estimate",
        str(csv),
        *SYSTEM,
        "--method",
        "normal-gamma",
        "--check",
        "--seed",
        "7",
        "--out",
        str(out),
    )
    result = run_json(capsys, *argv)
    reference = result["reference"]
    assert reference["sampler"] == "emcee"
    assert reference["agrees"] is True, reference["because"]
    assert reference["rhat"] < 1.01
    assert reference["ess_bulk"] > 1000.0
    assert reference["sampler_s"] > 0.0
    check_summary(reference["friction"], "N")

    assert strict((out / "estimate.json").read_text()) == result
    manifest = strict((out / "manifest.json").read_text())
    assert manifest["inputs"] == [{"record": str(csv), "sha256": sha256_of(csv)}]
    assert manifest["seed"] == 7
    assert manifest["versions"]["emcee"] == version("emcee")
    on_disk = {path.name for path in out.iterdir()}
    assert on_disk == {*manifest["files"], "manifest.json"}
    assert {"friction.png", "friction.pdf", "joint.png", "amplitudes.png", "reference.nc"} <= on_disk
    drawn = {"ranks.png", "ranks.pdf", "ess.png", "ess.pdf"}
    assert on_disk & drawn == (drawn if find_spec("arviz") else set())
    assert [path.name for path in out.parent.iterdir()] == ["results"]

    # A second run replaces its own files and leaves those of others alone.
    (out / "mine.txt").write_text("keep")
    request.getfixturevalue("empty_figures")
    assert main(["estimate", str(csv), *SYSTEM, "--method", "envelope", "--out", str(out), "--force"]) == 0
    assert not (out / "reference.nc").exists()
    assert (out / "fit.png").exists()
    assert (out / "mine.txt").read_text() == "keep"


@pytest.mark.usefixtures("empty_figures")
def test_figures_of_a_failed_run_do_not_stay(
    csv: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("friction_bayes.cli.commands.estimate.write_json", full)
    assert (
        main(["estimate", str(csv), *SYSTEM, "--method", "envelope", "--out", str(tmp_path / "results")]) == 1
    )
    assert [path.name for path in tmp_path.iterdir()] == ["decay.csv"]


def test_readable_table(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", str(csv), *SYSTEM]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    for word in ("decay.csv, waveform", "friction / stiffness", "P(friction < 0)", "frequency", "note"):
        assert word in shown.out


@pytest.mark.parametrize("before", [True, False])
@pytest.mark.parametrize("repeated", [True, False])
def test_prior_may_stand_anywhere(
    before: bool, repeated: bool, csv: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    entries = ["mu=0.1", "lam=0.01"]
    prior = ["--prior", entries[0], "--prior", entries[1]] if repeated else ["--prior", *entries]
    argv = [*prior, str(csv), *SYSTEM] if before else [str(csv), *SYSTEM, *prior]
    result = run_json(capsys, "estimate", "--method", "normal-gamma", *argv)
    assert (result["prior"]["mu"], result["prior"]["lam"]) == (0.1, 0.01)


def test_what_a_method_does_not_estimate_is_null(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frequency = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", "envelope")["frequency"]
    assert frequency["sd"] is None
    assert frequency["mean"] == pytest.approx(10.0, rel=1e-2)
    paper = run_json(capsys, "estimate", str(csv), *SYSTEM, "--method", "normal-gamma")
    assert paper["noise_sd"]["mean"] is None


@pytest.mark.usefixtures("empty_figures")
def test_several_records_make_a_table_and_a_list(
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    paths = [
        str(write_csv(name, *decay(amplitude=size), "displacement_m"))
        for name, size in (("far.csv", 0.02), ("near.csv", 0.015))
    ]
    command = ("estimate", *paths, *SYSTEM, "--method", "normal-gamma")
    results = run_json(capsys, *command)
    assert [each["record"] for each in results] == ["far.csv", "near.csv"]
    alone = run_json(capsys, "estimate", paths[1], *SYSTEM, "--method", "normal-gamma")
    assert results[1] == alone

    out = tmp_path / "out"
    assert main([*command, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    for result in results:
        (row,) = (line for line in said.splitlines() if line.lstrip().startswith(result["record"]))
        low, high = result["friction"]["interval90"]
        assert f"{result['friction']['mean']:.4g} N" in row
        assert f"{low:.4g} .. {high:.4g}" in row
        assert row.rstrip().endswith("  1") or "  1, " in row
    assert said.count("the stiffness is taken as exact") == 1
    assert "note 1" in said
    assert strict((out / "estimate.json").read_text()) == results
    figures = {f"{name}_{i}.png" for name in ("amplitudes", "friction", "joint") for i in (1, 2)}
    assert figures <= {path.name for path in out.iterdir()}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Friction of far.csv and near.csv" in page
    assert page.count("<img ") == 6

    assert main(["estimate", paths[0], paths[0], *SYSTEM]) == 2
    assert "far.csv: is given twice" in capsys.readouterr().err
