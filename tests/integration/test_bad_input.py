"""Every kind of bad input through the command line: exit status 2, one line that says it, nothing written."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from friction_bayes.cli.program import main
from refusals import refused

SYSTEM = ("--mass", "10", "--stiffness", "1000")
Signal = tuple[np.ndarray, np.ndarray]
Edit = Callable[[np.ndarray, np.ndarray], Signal]


def with_value(value: float) -> Edit:
    def edit(time: np.ndarray, signal: np.ndarray) -> Signal:
        signal[137] = value
        return time, signal

    return edit


def backwards(time: np.ndarray, signal: np.ndarray) -> Signal:
    time[[137, 138]] = time[[138, 137]]
    return time, signal


def doubled(time: np.ndarray, signal: np.ndarray) -> Signal:
    time[138] = time[137]
    return time, signal


def gap(time: np.ndarray, signal: np.ndarray) -> Signal:
    keep = (time < 1.0) | (time > 1.7)
    return time[keep], signal[keep]


RECORDS: dict[str, tuple[Edit, str]] = {
    "nan": (with_value(np.nan), "nan"),
    "infinity": (with_value(np.inf), "inf"),
    "short": (lambda time, signal: (time[:70], signal[:70]), "three half cycles"),
    "constant": (lambda time, signal: (time, np.full_like(signal, 0.01)), "constant"),
    "time_backwards": (backwards, "backwards"),
    "time_doubled": (doubled, "doubled"),
    "gap": (gap, "gap"),
    "square wave": (lambda time, signal: (time, np.sign(signal)), "nothing between"),
    "time in ms": (lambda time, signal: (1e3 * time, signal), "time in ms?"),
    "time in us": (lambda time, signal: (1e6 * time, signal), "time in us?"),
    "time in ns": (lambda time, signal: (1e9 * time, signal), "time in ns?"),
    "time in ks": (lambda time, signal: (1e-3 * time, signal), "time in h?"),
    "clipped": (lambda time, signal: (time, np.clip(signal, -0.015, 0.015)), "close-loop"),
    "empty": (lambda time, signal: (time[:0], signal[:0]), "decay.csv"),
}


@pytest.mark.parametrize("kind", RECORDS)
def test_bad_record(
    kind: str,
    tmp_path: Path,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    edit, said = RECORDS[kind]
    record = write_csv("decay.csv", *edit(*decay()), "displacement_m")
    out = tmp_path / "results"
    line = refused(capsys, "estimate", str(record), *SYSTEM, "--out", str(out))
    assert said in line
    assert "decay.csv" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["decay.csv"]


def test_clipped_says_how_much(
    decay: Callable[..., Signal], write_csv: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    # From mid-motion on: a flat start could also be the hold before a release.
    time, signal = (array[20:] for array in decay())
    record = write_csv("decay.csv", time, np.clip(signal, -1.0, 0.015), "displacement_m")
    share = np.mean(signal >= 0.015)
    assert f"{100.0 * share:.2f} %" in refused(capsys, "estimate", str(record), *SYSTEM)


OPTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "wrong unit": ((*SYSTEM, "--unit", "parsec"), "parsec"),
    "wrong quantity": ((*SYSTEM, "--quantity", "colour"), "colour"),
    "quantity of another system": (("--inertia", "1", "--stiffness", "100"), "inertia"),
    "negative mass": (("--mass", "-10", "--stiffness", "1000"), "mass"),
    "zero stiffness": (("--mass", "10", "--stiffness", "0"), "stiffness"),
    "infinite stiffness": (("--mass", "10", "--stiffness", "inf"), "stiffness"),
    "negative sd": ((*SYSTEM, "--mass-sd", "-1"), "mass_sd"),
    "sd larger than the stiffness": ((*SYSTEM, "--stiffness-sd", "1001"), "stiffness_sd"),
    "trust in what is not declared": ((*SYSTEM, "--trust", "inertia"), "trust"),
    "no mass": (("--stiffness", "1000"), "--mass"),
    "no stiffness": (("--mass", "10"), "--stiffness"),
    "mass and inertia": ((*SYSTEM, "--inertia", "1"), "both"),
    "mass of a pendulum": ((*SYSTEM, "--pendulum"), "pendulum"),
    "length without a mass": (("--length", "1"), "per kilogram"),
    "length and stiffness": ((*SYSTEM, "--length", "1"), "give length and mass alone"),
    "mass is a word": (("--mass", "heavy", "--stiffness", "1000"), "heavy"),
    "misspelt method": ((*SYSTEM, "--method", "waveforms"), "'waveforms' (did you mean waveform?)"),
    "unknown peaks": ((*SYSTEM, "--peaks", "lowest"), "nominal"),
    "unknown prior key": ((*SYSTEM, "--method", "normal-gamma", "--prior", "nu=1"), "lam"),
    "prior without value": ((*SYSTEM, "--prior", "alpha"), "KEY=VALUE"),
    "prior is a word": ((*SYSTEM, "--prior", "alpha=one"), "one"),
    "prior is not finite": ((*SYSTEM, "--prior", "alpha=nan"), "nan"),
    "prior given twice": ((*SYSTEM, "--prior", "alpha=1", "--prior", "alpha=2"), "twice"),
    "negative prior": ((*SYSTEM, "--method", "normal-gamma", "--prior", "lam=-1"), "lam"),
    "prior of less than no sample": ((*SYSTEM, "--prior", "alpha=-200"), "prior alpha: -200 is too small"),
    "end before the start": ((*SYSTEM, "--start", "2", "--end", "1"), "give an end after the start"),
    "mass in g": (("--mass", "1e4", "--stiffness", "1000"), "in g or N/mm?; give kg and N/m"),
    "mass too large": (("--mass", "2e4", "--stiffness", "1000"), "or check mass and stiffness"),
    "mass far too small": (("--mass", "0.1", "--stiffness", "1000"), "take one decay by --start and --end"),
    "negative threshold": ((*SYSTEM, "--accept-precision", "-3"), "accept_precision"),
    "threshold and set-up": ((*SYSTEM, "--accept-precision", "3", "--setup", "x.csv"), "--setup"),
    "no precision to accept by": (
        (*SYSTEM, "--method", "gamma-exponential", "--accept-precision", "3"),
        "gamma-exponential",
    ),
    "missing set-up record": ((*SYSTEM, "--setup", "nowhere.csv"), "nowhere.csv"),
    "start outside the record": ((*SYSTEM, "--start", "99"), "start"),
    "start after the motion": ((*SYSTEM, "--start", "4.95"), "three half cycles"),
    "decimal comma": (
        ("--mass", "0,5", "--stiffness", "1"),
        "estimate: argument --mass: '0,5' is not a number: write a decimal point, and nothing between",
    ),
    "decimal comma in a prior": (
        (*SYSTEM, "--prior", "mu=0,1"),
        "--prior mu: '0,1' is not a number: write a decimal point",
    ),
    "unknown option": ((*SYSTEM, "--colour", "red"), "estimate: unknown argument --colour; see"),
    "misspelt option": ((*SYSTEM, "--methd", "envelope"), "--methd (did you mean --method?)"),
    "abbreviated option": ((*SYSTEM, "--meth", "waveform"), "--meth"),
    "unknown column": ((*SYSTEM, "--signal-column", "torque"), "torque"),
}


@pytest.mark.parametrize("kind", OPTIONS)
def test_bad_option(kind: str, csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options, said = OPTIONS[kind]
    line = refused(capsys, "estimate", str(csv), *options, "--out", str(tmp_path / "results"))
    assert said in line
    assert [path.name for path in tmp_path.iterdir()] == ["decay.csv"]


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (("estimate", "nowhere.csv", *SYSTEM), "nowhere.csv"),
        (("estimate", "dataset:nonsense"), "nonsense"),
        (("estimate", "dataset:bicycle-fork", "--unit", "V"), "--unit"),
        (("estimate", "dataset:bicycle-fork", "--run", "0"), "--run: does not apply to dataset:bicycle-fork"),
        (("estimate",), "RECORD"),
        ((), "COMMAND"),
        (("guess",), "guess"),
        (("close_loop",), "(did you mean close-loop?)"),
        (("datasets", "get", "nonsense"), "nonsense"),
        (("datasets",), "ACTION"),
        (("simulate", *SYSTEM, "--friction", "-1", "--out", "x.csv"), "--friction: -1 is negative"),
        (("simulate", *SYSTEM, "--friction", "0", "--out", "x.csv"), "--initial-displacement"),
        (("simulate", *SYSTEM, "--friction", "0.1", "--out", "x.doc"), ".doc"),
        (
            ("simulate", *SYSTEM, "--friction", "0.1", "--effect", "viscous.x=1", "--out", "x.csv"),
            "unknown effect 'viscous'; give one of viscous_damping",
        ),
        (
            ("simulate", *SYSTEM, "--friction", "0.1", "--effect", "strybeck_friction.x=1", "--out", "x.csv"),
            "'strybeck_friction' (did you mean stribeck_friction?)",
        ),
        (
            ("simulate", *SYSTEM, "--friction", "0.1", "--sampling-rate", "0", "--out", "x.csv"),
            "sampling_rate",
        ),
        (
            ("simulate", *SYSTEM, "--friction", "1e-9", "--initial-displacement", "1", "--out", "x.csv"),
            "a shorter duration or a lower sampling rate",
        ),
        (("simulate", *SYSTEM, "--friction", "0.1"), "--out"),
        (
            ("simulate", *SYSTEM, "--friction", "5", "--initial-displacement", "0.001", "--out", "x.csv"),
            "5 N holds what is released at 0.001 m: it never moves",
        ),
    ],
)
def test_bad_command(
    argv: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in refused(capsys, *argv)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_all_records_that_are_refused_are_named(
    command: str,
    tmp_path: Path,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    time, signal = decay()
    good = write_csv("good.csv", time, signal, "displacement_m")
    short = write_csv("short.csv", time[:70], signal[:70], "displacement_m")
    noise = write_csv("still.csv", time, np.random.default_rng(1).normal(size=time.size), "displacement_m")
    argv = (command, str(good), str(short), str(noise), *SYSTEM, "--out", str(tmp_path / "results"))
    line = refused(capsys, *argv)
    assert "2 records are refused: (1) short.csv: fewer than three half cycles" in line
    assert "; (2) still.csv: no free oscillation" in line
    assert "are refused" not in refused(capsys, *argv, "--mass-sd", "-1")


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_a_file_of_several_runs(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["runs.csv"] if command != "monitor" else ["runs.csv", "later.csv"]
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.write_text("Time (s) Run #1;Angle (rad) Run #1;Time (s) Run #4;Angle (rad) Run #4\n0;1;0;2\n")
    argv = (command, *map(str, paths), *SYSTEM, "--out", str(tmp_path / "results"))
    assert "holds 2 runs; choose one with --run: 1, 4" in refused(capsys, *argv)
    assert "there is no run 2; choose one with --run: 1, 4" in refused(capsys, *argv, "--run", "2")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_existing_results_need_force(csv: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "results"
    out.mkdir()
    (out / "mine.txt").write_text("keep")
    assert "--force" in refused(capsys, "estimate", str(csv), *SYSTEM, "--out", str(out))
    assert [path.name for path in out.iterdir()] == ["mine.txt"]


def test_results_over_a_file(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = csv.read_text()
    assert "is a file" in refused(capsys, "estimate", str(csv), *SYSTEM, "--out", str(csv), "--force")
    assert csv.read_text() == before


def test_existing_record_needs_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "decay.csv"
    target.write_text("keep")
    assert "--force" in refused(capsys, "simulate", *SYSTEM, "--friction", "0.5", "--out", str(target))
    assert target.read_text() == "keep"


def test_set_up_record_of_another_sensor(
    csv: Path,
    decay: Callable[..., Signal],
    write_csv: Callable[..., Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    time, signal = decay()
    other = write_csv("other.csv", time, 100.0 * signal, "acceleration_m_s2")
    assert "other.csv" in refused(capsys, "estimate", str(csv), *SYSTEM, "--setup", str(other))


def test_a_defect_is_called_one(
    csv: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("on\npurpose")

    monkeypatch.setattr("friction_bayes.estimate", broken, raising=False)
    monkeypatch.delenv("FRICTION_BAYES_DEBUG", raising=False)
    assert main(["estimate", str(csv), *SYSTEM]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "defect" in line
    assert "ZeroDivisionError: on purpose" in line

    monkeypatch.setenv("FRICTION_BAYES_DEBUG", "1")
    with pytest.raises(ZeroDivisionError, match="on\npurpose"):
        main(["estimate", str(csv), *SYSTEM])


@pytest.mark.parametrize("argv", [("estimate", "nowhere.csv", *SYSTEM), ("estimate", "--colour")])
def test_in_a_process_of_its_own(argv: tuple[str, ...], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "friction_bayes", *argv],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr
