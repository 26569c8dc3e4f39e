"""Records that yield a number, but not a right one: mended and named, warned of, or refused."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from decays import SYSTEM, written_decay
from friction_bayes import RecordWarning, estimate, make_record
from friction_bayes.cli.program import main
from friction_bayes.core.arrays import Array

DECLARED = ("--mass", "10", "--stiffness", "1000")
FRICTION = 0.5
TIME = np.arange(1000) / 100.0
NOISE_SD = 5e-5

WriteCsv = Callable[..., Path]


@pytest.fixture
def plain(rng: np.random.Generator) -> Array:
    """A decay from 20 mm under 0.5 N, 10 s at 63 samples a period, with its rest."""
    stops = 20.0 * np.pi / 10.0
    moving = written_decay(np.minimum(TIME, stops), 0.02, FRICTION / 1000.0)
    return moving + rng.normal(0.0, NOISE_SD, TIME.size)


@pytest.fixture
def run(
    tmp_path: Path, write_csv: WriteCsv, capsys: pytest.CaptureFixture[str], without_loop_folder: None
) -> Callable[..., Any]:
    """Write a signal and give it to a command: its JSON, or its one line of refusal."""

    def command(name: str, signal: Array, time: Array = TIME, *options: str) -> Any:
        record = write_csv("decay.csv", time, signal, "displacement_m")
        out = ("--out", str(tmp_path / "loop"), "--force") if name == "close-loop" else ()
        status = main([name, str(record), *DECLARED, "--json", *out, *options])
        shown = capsys.readouterr()
        if status == 0:
            return json.loads(shown.out)
        assert status == 2, shown.err
        (line,) = shown.err.splitlines()
        return line

    return command


def covers(friction: dict[str, Any], truth: float) -> bool:
    low, high = friction["interval90"]
    # the interval of the middle 90 % is widened to that of 99.7 %: one draw is judged
    return abs(friction["mean"] - truth) < 0.91 * (high - low)


@pytest.mark.parametrize("value", [50.0, 3.0, 0.3, -9.99])
@pytest.mark.parametrize("method", ["waveform", "envelope", "normal-gamma"])
def test_one_wild_sample_is_named_and_set_aside(
    run: Callable[..., Any], plain: Array, value: float, method: str
) -> None:
    usual = run("estimate", plain, TIME, "--method", method)
    wild = plain.copy()
    wild[311] = value
    found = run("estimate", wild, TIME, "--method", method)
    reported = found["notes"][-1]
    assert (
        f"1 sample leaps out of the motion, the first to {value:g} m at sample 312 (t = 3.11 s)" in reported
    )
    assert found["friction"]["mean"] == pytest.approx(usual["friction"]["mean"], abs=usual["friction"]["sd"])
    assert found["friction"]["sd"] == pytest.approx(usual["friction"]["sd"], rel=0.1)


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ([90, 234, 410], "3 samples leap out of the motion"),
        ([310, 311, 312], "3 samples in 1 run of one value each"),
        ([0, 1, 998], "3 samples leap out of the motion"),
    ],
)
def test_marks_of_missing_samples_are_no_saturation(
    run: Callable[..., Any], plain: Array, places: list[int], said: str
) -> None:
    plain[places] = -9.99
    found = run("estimate", plain)
    assert said in found["notes"][-1]
    assert covers(found["friction"], FRICTION)
    assert found["noise_sd"]["mean"] == pytest.approx(NOISE_SD, rel=0.1)


def test_marks_that_last_are_refused(run: Callable[..., Any], plain: Array) -> None:
    """Over a period: nothing says what the mass did meanwhile."""
    plain[310:380] = -9.99
    for command in ("estimate", "close-loop"):
        line = run(command, plain)
        assert "70 samples lie far out of the motion, the first -9.99 m at sample 311" in line
        assert line.endswith("cut the record there, by --start or --end")


def test_the_loop_sets_the_same_samples_aside(run: Callable[..., Any], plain: Array) -> None:
    plain[[311, 500, 501]] = [50.0, -9.99, -9.99]
    found = run("close-loop", plain)
    assert found["verdict"] == "adequate"
    assert covers(found["friction_after"], FRICTION)
    assert found["fitted"]["set_aside"] == 3
    assert found["noise"]["sd"] == pytest.approx(NOISE_SD, rel=0.1)
    assert "2 samples in 1 run of one value each" in found["notes"][0]
    assert "1 sample leaps out of the motion" in found["notes"][1]


def test_a_number_of_samples_a_period_is_asked_for_by_both(run: Callable[..., Any]) -> None:
    time = np.arange(60) * (2.0 * np.pi / 10.0 / 1.5)
    signal = written_decay(time, 0.08, FRICTION / 1000.0)
    lines = {run(command, signal, time) for command in ("estimate", "close-loop")}
    (line,) = lines
    assert "1.5 samples a period of the declared 10 rad/s: it lies above Nyquist's frequency" in line
    assert "sample faster than 3.18 Hz" in line


def second_mode(frequency: float, first: float, second: float) -> Array:
    swing = np.exp(-0.02 * TIME) * np.cos(frequency * TIME + 0.3)
    return written_decay(TIME, first, 1e-4) + second * swing


@pytest.mark.parametrize(
    ("signal", "frequencies"),
    [
        (second_mode(14.0, 0.02, 0.02), (14.0, 10.0)),
        (second_mode(23.0, 0.008, 0.02), (23.0, 10.0)),
        (second_mode(20.0, 0.008, 0.02), (20.0, 10.0)),
        (np.abs(written_decay(TIME, 0.02, 1e-4)), (20.0, 40.0)),
    ],
    ids=["two alike", "23 rad/s", "20 rad/s", "rectified"],
)
def test_what_is_not_one_mode_is_refused(
    run: Callable[..., Any], rng: np.random.Generator, signal: Array, frequencies: tuple[float, float]
) -> None:
    noisy = signal + rng.normal(0.0, NOISE_SD, TIME.size)
    for command in ("estimate", "close-loop"):
        line = run(command, noisy)
        reported = re.search(r"oscillations at (\S+) and (\S+) rad/s, the second \d+ % as strong", line)
        assert reported, line
        assert [float(found) for found in reported.groups()] == pytest.approx(frequencies, rel=0.03)


@pytest.mark.parametrize(
    "signal",
    [
        0.002 * np.exp(0.05 * TIME) * np.cos(10.0 * TIME),
        (0.002 + 4e-4 * TIME) * np.cos(10.0 * TIME),
        0.0147 * np.cos(10.0 * TIME),
        0.0147 * np.cos(9.5 * TIME),
    ],
    ids=["growing", "growing on a line", "steady", "driven"],
)
def test_what_does_not_decay_is_refused(
    run: Callable[..., Any], rng: np.random.Generator, signal: Array
) -> None:
    noisy = signal + rng.normal(0.0, NOISE_SD, TIME.size)
    for command in ("estimate", "close-loop"):
        line = run(command, noisy)
        assert "no loss of amplitude shows: the motion is steady or grows, as if driven" in line


def test_a_weaker_mode_is_reported(run: Callable[..., Any], plain: Array) -> None:
    found = run("estimate", plain + 0.002 * np.cos(23.0 * TIME))
    assert any("another oscillation at 23" in note for note in found["notes"])
    assert covers(found["friction"], FRICTION)


def test_a_zero_far_off_changes_nothing(run: Callable[..., Any], plain: Array) -> None:
    # written with nine digits
    here, *off = (run("estimate", plain + offset)["friction"] for offset in (0.0, 0.06, 6.8))
    for there in off:
        assert there["mean"] == pytest.approx(here["mean"], rel=1e-4)
        assert there["sd"] == pytest.approx(here["sd"], rel=1e-2)


def test_the_loop_finds_the_same_about_a_zero_far_off(run: Callable[..., Any], plain: Array) -> None:
    alone = run("estimate", plain)["friction"]
    found = run("close-loop", plain + 6.8)
    assert found["friction_before"]["mean"] == pytest.approx(alone["mean"], abs=alone["sd"])
    assert covers(found["friction_after"], FRICTION)
    assert [effect["name"] for effect in found["effects"]] == ["sensor_offset"]


def test_a_push_before_rest_is_warned_of(plain: Array, write_csv: WriteCsv, capsys: Any) -> None:
    """It adds 8 mm at 3.1 s, when 11 mm are left."""
    later = np.maximum(TIME - 3.1, 0.0)
    record = write_csv("decay.csv", TIME, plain + 0.008 * np.sin(10.0 * later), "displacement_m")
    assert main(["estimate", str(record), *DECLARED]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert -1 < shown.index("warning in addition to friction a force") < shown.index("friction / stiffness")
    assert re.search(r"would have to act \d+ times as large, which is rather a push", shown)


@pytest.fixture
def viscous(rng: np.random.Generator) -> Array:
    return 0.02 * np.exp(-0.1 * TIME) * np.cos(10.0 * TIME) + rng.normal(0.0, NOISE_SD, TIME.size)


def test_a_decay_without_dry_friction_is_warned_of_before_the_number(
    viscous: Array, write_csv: WriteCsv, capsys: pytest.CaptureFixture[str]
) -> None:
    record = write_csv("decay.csv", TIME, viscous, "displacement_m")
    assert main(["estimate", str(record), *DECLARED]) == 0
    shown = capsys.readouterr().out
    assert -1 < shown.index("falls faster while it is larger") < shown.index("friction / stiffness")
    assert shown.index("warning") < shown.index("90 %")
    with pytest.warns(RecordWarning, match="falls faster while it is larger"):
        estimate(make_record(TIME, viscous, "displacement"), SYSTEM, random_force="none")


def test_the_loop_limits_dry_friction_where_there_is_none(run: Callable[..., Any], viscous: Array) -> None:
    found = run("close-loop", viscous)
    assert "viscous_damping" in [effect["name"] for effect in found["effects"]]
    assert found["dry_friction"]["probability"] < 0.05
    # what would take the loss of amplitude alone is 0.1 * 20 mm * 1000 N/m * pi / 40 = 0.16 N
    assert found["dry_friction"]["upper95"] < 0.02


def test_averaging_is_said_and_noise_is_that_of_a_sample(
    run: Callable[..., Any], rng: np.random.Generator
) -> None:
    time = np.arange(4000) / 1000.0
    signal = written_decay(time, 0.02, FRICTION / 1000.0) + rng.normal(0.0, 1e-3, time.size)
    found = run("close-loop", signal, time, "--effects", "viscous_damping")
    assert any("averaged in blocks of 3 samples" in note for note in found["notes"])
    assert found["fitted"]["samples"] > 3900
    # six standard errors
    assert found["noise"]["sd"] == pytest.approx(1e-3, rel=6.0 / np.sqrt(2.0 * time.size))
    assert covers(found["friction_after"], FRICTION)


@pytest.mark.parametrize("ends", ["record", "motion"])
def test_no_verdict_on_fewer_than_three_half_cycles(
    run: Callable[..., Any], rng: np.random.Generator, ends: str
) -> None:
    time = TIME[: 85 if ends == "record" else 300]
    moving = np.minimum(time, np.pi / 5.0)
    signal = written_decay(
        time if ends == "record" else moving, 0.02, FRICTION / 1000.0 if ends == "record" else 5e-3
    )
    noisy = signal + rng.normal(0.0, NOISE_SD, time.size)
    for command in ("estimate", "close-loop"):
        assert "fewer than three half cycles of free motion" in run(command, noisy, time)


@pytest.mark.parametrize(("start", "end"), [("0.21", "0.6"), ("0.18", "0.81"), ("0.36", "0.78")])
def test_a_bend_is_no_oscillation(run: Callable[..., Any], plain: Array, start: str, end: str) -> None:
    line = run("estimate", plain, TIME, "--start", start, "--end", end)
    assert "fewer than three half cycles of free motion" in line
