"""Recordings as laboratories have them, through the command line: read, or one line that says why not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from friction_bayes.cli.program import main

Signal = tuple[np.ndarray, np.ndarray]
Decay = Callable[..., Signal]
LINEAR = ("--mass", "10", "--stiffness", "1000")
ROTARY = ("--inertia", "10", "--stiffness", "1000")
FRICTION = 0.5


def rows_of(time: np.ndarray, signal: np.ndarray, separator: str = ",") -> list[str]:
    return [f"{t:.9g}{separator}{x:.9g}" for t, x in zip(time, signal, strict=True)]


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., str]:
    """Write lines to a file and return its path."""

    def lines_to(lines: list[str], name: str = "decay.csv") -> str:
        (tmp_path / name).write_text("\n".join(lines) + "\n", encoding="utf-8")
        return str(tmp_path / name)

    return lines_to


@pytest.fixture
def friction(capsys: pytest.CaptureFixture[str]) -> Callable[..., float]:
    """Estimate a record and return its mean friction."""

    def estimated(*argv: str) -> float:
        status = main(["estimate", *argv, "--method", "envelope", "--json"])
        shown = capsys.readouterr()
        assert status == 0, shown.err
        return json.loads(shown.out)["friction"]["mean"]

    return estimated


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command that must be refused and return its one line."""

    def line_of(*argv: str) -> str:
        status = main(argv)
        shown = capsys.readouterr()
        assert (status, shown.out) == (2, ""), shown.err
        (line,) = shown.err.splitlines()
        return line

    return line_of


@pytest.mark.parametrize(
    ("header", "per_unit", "system"),
    [
        ("Time (s),Position (mm)", 1e3, LINEAR),
        ("t,disp_um", 1e6, LINEAR),
        ("Time [s],Displacement [inch]", 1.0 / 0.0254, LINEAR),
        ("t / s,x / nm", 1e9, LINEAR),
        ("Time (s),Angle (deg)", 180.0 / math.pi, ROTARY),
        ("Time (s),Angle (°)", 180.0 / math.pi, ROTARY),
        ("elapsed time (sec),theta (Degrees)", 180.0 / math.pi, ROTARY),
    ],
)
def test_the_unit_in_a_header_is_read(
    header: str,
    per_unit: float,
    system: tuple[str, ...],
    decay: Decay,
    write: Callable[..., str],
    friction: Callable[..., float],
) -> None:
    time, signal = decay()
    path = write([header, *rows_of(time, per_unit * signal)])
    assert friction(path, *system) == pytest.approx(FRICTION, rel=0.02)
    kind = "angle" if system is ROTARY else "displacement"
    by_number = ("--time-column", "0", "--signal-column", "1", "--quantity", kind)
    assert friction(path, *system, *by_number) == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("header", ["Time (s),a_x (g)", "time,gFx", "Time (s),Acceleration x (m/s^2)"])
def test_acceleration_in_g(
    header: str, decay: Decay, write: Callable[..., str], friction: Callable[..., float]
) -> None:
    time, signal = decay(noise_sd=0.0)
    scale = 1.0 if "m/s" in header else 9.80665
    acceleration = np.gradient(np.gradient(signal, time), time) / scale
    path = write([header, *rows_of(time, acceleration)])
    assert friction(path, *LINEAR) == pytest.approx(FRICTION, rel=0.1)


def test_tdms_whose_channel_names_its_unit(
    tmp_path: Path, decay: Decay, friction: Callable[..., float]
) -> None:
    from nptdms import ChannelObject, TdmsWriter

    time, signal = decay()
    # LabVIEW leaves the offset out where it is zero
    timing = {"wf_increment": float(time[1] - time[0]), "wf_samples": time.size}
    with TdmsWriter(tmp_path / "decay.tdms") as writer:
        writer.write_segment([ChannelObject("Untitled", "disp_mm", 1e3 * signal, properties=timing)])
    assert friction(str(tmp_path / "decay.tdms"), *LINEAR) == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_a_unit_that_is_not_known_is_asked_for(
    command: str, tmp_path: Path, decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    paths = [write(["t,x", *rows_of(*decay())], name) for name in ("one.csv", "two.csv")]
    argv = (command, *(paths if command == "monitor" else paths[:1]), *LINEAR, "--out", str(tmp_path / "out"))
    assert "--quantity and --unit" in refused(*argv)
    assert "column 'x' does not say its unit; give --unit, one of m, cm, mm" in refused(
        *argv, "--signal-column", "1", "--quantity", "displacement"
    )


@pytest.mark.parametrize(
    ("told", "per_metre"),
    [
        (("--unit", "mV/mm", "--scale", "250"), 250e3),
        (("--unit", "counts/mm", "--scale", "-80"), -80e3),
        (("--unit", "cm", "--scale", "0.01"), 1e4),
    ],
)
def test_a_scale_with_its_unit(
    told: tuple[str, ...],
    per_metre: float,
    decay: Decay,
    write: Callable[..., str],
    friction: Callable[..., float],
) -> None:
    time, signal = decay()
    path = write(["t,y", *rows_of(time, per_metre * signal)])
    assert friction(path, *LINEAR, "--quantity", "displacement", *told) == pytest.approx(FRICTION, rel=0.02)
