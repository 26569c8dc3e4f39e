"""Recordings as laboratories have them, through the command line: read, or one line that says why not."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from decays import recording_of_decays, written_decay
from friction_bayes import read_record, write_record
from friction_bayes.cli.program import main
from kinds_of_files import FRICTION, KINDS, Kind, arduino, page, phyphox

ROOT = Path(__file__).parents[2]
Signal = tuple[np.ndarray, np.ndarray]
Decay = Callable[..., Signal]
LINEAR = ("--mass", "10", "--stiffness", "1000")
ROTARY = ("--inertia", "10", "--stiffness", "1000")


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


def time_of_day(seconds: float, *, dated: bool) -> str:
    """Two seconds before midnight of a leap day, and so many more."""
    days, time = divmod(86398.0 + seconds, 86400.0)
    clock = f"{time // 3600:02.0f}:{time % 3600 // 60:02.0f}:{time % 60:06.3f}"
    return f"{'2024-03-01' if days else '2024-02-29'}T{clock}Z" if dated else clock


@pytest.mark.parametrize(
    ("header", "dated", "decimal", "clock"),
    [
        ("Time;Position (m)", False, ".", "Time [s since 23:59:58.000]"),
        ("Timestamp;disp_m", True, ",", "Timestamp [s since 2024-02-29T23:59:58,000Z]"),
        ("Timestamp;disp_m;Time (s)", True, ".", "Time (s) [s]"),
    ],
)
def test_times_of_the_day(
    header: str,
    dated: bool,
    decimal: str,
    clock: str,
    decay: Decay,
    write: Callable[..., str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    cells = ((time_of_day(t, dated=dated), f"{x:.9g}", f"{t:.3f}") for t, x in zip(*decay(), strict=True))
    rows = [";".join(row[: header.count(";") + 1]).replace(".", decimal) for row in cells]
    assert main(["estimate", write([header, *rows]), *LINEAR, "--method", "envelope"]) == 0
    assert f"over {clock}: 500 samples, 100 Hz, 0 to 4.99 s" in " ".join(capsys.readouterr().out.split())


def test_what_is_no_time_of_the_day_is_named(
    decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    rows = [f"{time_of_day(t, dated=False)},{x:.9g}" for t, x in zip(*decay(), strict=True)]
    rows[30] = "noon,0"
    line = refused("estimate", write(["Time,Position (m)", *rows]), *LINEAR)
    assert "row 32: column Time: 'noon' is not a time of the day like 23:59:58.000" in line
    rows[0] = rows[1] = "29 Feb 2024 23:59:58,0"
    line = refused("estimate", write(["Time,Position (m)", *rows]), *LINEAR)
    assert line.endswith("write times like 12:03:04.250 or 2024-03-01T12:03:04.250, or give --sampling-rate")


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


def test_a_file_that_ends_too_soon_is_said_to(
    tmp_path: Path, decay: Decay, capsys: pytest.CaptureFixture[str]
) -> None:
    from nptdms import ChannelObject, TdmsWriter

    time, signal = decay()
    timing = {"wf_increment": float(time[1] - time[0]), "wf_samples": time.size}
    path = tmp_path / "decay.tdms"
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("Untitled", "disp_mm", 1e3 * signal, properties=timing)])
    path.write_bytes(path.read_bytes()[:-800])
    assert main(["estimate", str(path), *LINEAR, "--method", "envelope"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "decay.tdms: the file is damaged or ends too soon" in " ".join(shown.out.split())


def test_a_file_that_a_library_leaves_half_open_is_refused_in_one_line(tmp_path: Path, csv: Path) -> None:
    path = tmp_path / "decay.nc"
    write_record(read_record(csv), path)
    content = bytearray(path.read_bytes())
    # in the header of the first object, beyond the superblock
    content[139] ^= 140
    path.write_bytes(content)
    argv = [sys.executable, "-m", "friction_bayes", "estimate", str(path), *LINEAR]
    done = subprocess.run(argv, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert "this is not a NetCDF file" in line


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_a_unit_that_is_not_known_is_asked_for(
    command: str, tmp_path: Path, decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    paths = [write(["t,x", *rows_of(*decay())], name) for name in ("one.csv", "two.csv")]
    argv = (command, *(paths if command == "monitor" else paths[:1]), *LINEAR, "--out", str(tmp_path / "out"))
    assert "--signal-column, --quantity and --unit" in refused(*argv)
    assert "column 'x' does not say its unit; give --unit, one of m, cm, mm" in refused(
        *argv, "--signal-column", "1", "--quantity", "displacement"
    )


@pytest.mark.parametrize(
    ("stated", "per_metre"),
    [
        (("--unit", "mV/mm", "--scale", "250"), 250e3),
        (("--unit", "counts/mm", "--scale", "-80"), -80e3),
        (("--unit", "cm", "--scale", "0.01"), 1e4),
    ],
)
def test_a_scale_with_its_unit(
    stated: tuple[str, ...],
    per_metre: float,
    decay: Decay,
    write: Callable[..., str],
    friction: Callable[..., float],
) -> None:
    time, signal = decay()
    path = write(["t,y", *rows_of(time, per_metre * signal)])
    assert friction(path, *LINEAR, "--quantity", "displacement", *stated) == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_each_kind_of_file_is_read_or_refused_in_words(
    kind: Kind, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kind.write(tmp_path / kind.name)
    argv = ["estimate", str(tmp_path / kind.name), *kind.system, *kind.stated, "--method", "envelope"]
    status = main(argv)
    shown = capsys.readouterr()
    if kind.read:
        assert status == 0, shown.err
        printed = " ".join(shown.out.split())
        assert f"read {kind.says}: " in printed
        found = re.search(r"friction (\S+) N", printed)
        assert found is not None
        assert float(found[1]) == pytest.approx(FRICTION, rel=0.01)
    else:
        assert (status, shown.out) == (2, "")
        (line,) = shown.err.splitlines()
        assert kind.says in line


def test_the_page_of_kinds_is_today_s() -> None:
    assert (ROOT / "docs" / "kinds_of_files.md").read_text(encoding="utf-8") == page()


@pytest.fixture
def several(write: Callable[..., str], rng: np.random.Generator) -> str:
    """Three decays in one recording, several.csv."""
    signal = recording_of_decays()
    noisy = signal + rng.normal(0.0, 1e-4, signal.size)
    return write(["time_s,displacement_m", *rows_of(np.arange(signal.size) / 100.0, noisy)], "several.csv")


def test_a_decay_is_chosen_of_several(
    several: str, tmp_path: Path, friction: Callable[..., float], refused: Callable[..., str]
) -> None:
    loop = ("close-loop", several, *LINEAR, "--out", str(tmp_path / "loop"))
    for command in (("estimate", several, *LINEAR), loop):
        line = refused(*command)
        assert "holds 3 free decays, 1: 1.2" in line
        assert line.endswith(
            "choose one by --decay N, each by --decay all, or part of the record by --start and --end"
        )
        assert "--decay: 4, and the record holds 3 free decays" in refused(*command, "--decay", "4")
        assert "--decay: '0' is neither a number from 1 upwards nor all" in refused(*command, "--decay", "0")
    for decay in "123":
        assert friction(several, *LINEAR, "--decay", decay) == pytest.approx(FRICTION, rel=0.02)
    # those behind the start are counted
    assert friction(several, *LINEAR, "--start", "9", "--decay", "2") == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.usefixtures("without_loop_figures")
def test_all_decays_of_a_recording_are_taken_together(
    several: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By `estimate` each by itself, by `close-loop` as records of one law."""
    assert main(["estimate", several, *LINEAR, "--decay", "all", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [each["record"] for each in found] == [f"several.csv decay {k}" for k in (1, 2, 3)]
    for each in found:
        assert each["friction"]["mean"] == pytest.approx(FRICTION, rel=0.02)
    few = ("--effects", "viscous_damping,random_force")
    assert (
        main(["close-loop", several, *LINEAR, *few, "--decay", "all", "--out", str(tmp_path / "loop")]) == 0
    )
    shown = " ".join(capsys.readouterr().out.split())
    assert "read several.csv decay 1: displacement_m [m] over time_s [s], decay 1 of 3: " in shown
    report = json.loads((tmp_path / "loop" / "report.json").read_text())
    low, high = report["friction_after"]["interval90"]
    assert low < FRICTION < high
    # one decay is all of a recording that holds one
    assert main(["estimate", several, *LINEAR, "--end", "8", "--decay", "all", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["record"] == "several.csv"


def test_decays_of_one_recording_are_detection_points(
    several: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["monitor", several, *LINEAR, "--out", str(tmp_path / "wear")]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "read several.csv decay 1: displacement_m [m] over time_s [s]: " in shown
    report = json.loads((tmp_path / "wear" / "monitor.json").read_text())
    points = report["data_acquisition"]["points"]
    assert [point["record"] for point in points] == [f"several.csv decay {k}" for k in (1, 2, 3)]
    assert [point["time"] for point in points] == pytest.approx([0.5, 9.7, 18.9], abs=0.5)
    assert report["data_acquisition"]["time_unit"] == "s"


def test_what_was_understood_is_printed(csv: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["estimate", str(csv), *LINEAR, "--method", "envelope"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert (
        "read displacement_m [m] over time_s [s]: 500 samples, 100 Hz, 0 to 4.99 s; fitted 0 to 4." in shown
    )
    assert "half cycles, first amplitude 0.02 m friction" in shown


def test_several_channels_are_listed(
    decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    path = write(phyphox(*decay()))
    problem = refused("estimate", path, *ROTARY)
    assert re.search(
        r"several signals: Gyroscope x \(rad/s\) \[sd [\d.]+ rad/s\], Gyroscope y \(rad/s\) \[sd", problem
    )


def test_a_column_of_milliseconds_is_asked_about(
    decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    reported = ("--time-column", "0", "--signal-column", "1", "--quantity", "displacement", "--unit", "um")
    line = refused("estimate", write(arduino(*decay())), *LINEAR, *reported)
    assert "0.0628 samples a period of the declared 10 rad/s, 62.83 with the times in ms: time in ms?" in line


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_what_is_not_reported_from_the_table_is_skipped(
    command: str, tmp_path: Path, decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    lines = ["1,2", "3,4", "time_s,displacement_m", *rows_of(*decay()), "the end"]
    paths = [write(lines, name) for name in ("one.csv", "two.csv")]
    argv = (command, *(paths if command == "monitor" else paths[:1]), *LINEAR, "--out", str(tmp_path / "out"))
    assert "row 504: found 1 of 2 cells" in refused(*argv, "--skip-rows", "2")


def test_rows_are_skipped_of_text_alone(tmp_path: Path, refused: Callable[..., str]) -> None:
    (tmp_path / "decay.nc").touch()
    argv = ("estimate", str(tmp_path / "decay.nc"), *LINEAR, "--skip-rows", "2")
    assert "--skip-rows: does not apply to .nc files" in refused(*argv)


@pytest.mark.parametrize("command", ["estimate", "close-loop", "monitor"])
def test_start_and_end_cut_before_a_record_is_judged(
    command: str, tmp_path: Path, decay: Decay, write: Callable[..., str], refused: Callable[..., str]
) -> None:
    time, signal = decay()
    signal[[20, 480]] = np.nan
    paths = [
        write(["time_s,displacement_m", *rows_of(time, signal)], name) for name in ("one.csv", "two.csv")
    ]
    argv = (command, *(paths if command == "monitor" else paths[:1]), *LINEAR, "--out", str(tmp_path / "out"))
    assert "signal is nan at row 22 (t = 0.2 s) and 1 more" in refused(*argv)
    assert "signal is nan at row 482 (t = 4.8 s); " in refused(*argv, "--start", "0.21")
    assert "7 samples; give at least 8" in refused(*argv, "--start", "0.21", "--end", "0.27")
    assert "--end: 9 s lies outside one.csv; give 0 to 4.99 s" in refused(*argv, "--end", "9")
    assert "--end: 1 s is before --start 2 s" in refused(*argv, "--start", "2", "--end", "1")


@pytest.mark.usefixtures("without_loop_folder")
@pytest.mark.parametrize("stamps", ["logger", "phone"])
def test_uneven_times_are_used_as_they_are(
    stamps: str,
    rng: np.random.Generator,
    write: Callable[..., str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """At seven samples a period, where a spline is off by 1 %: a slow error of the clock, and jitter."""
    time = 0.09 * np.arange(100)
    wander = 0.05 * np.sin(0.7 * time)
    uneven = time + (wander if stamps == "logger" else 0.03 * rng.uniform(-1.0, 1.0, time.size))
    path = write(["Time (s),Position (m)", *rows_of(uneven, written_decay(uneven, 0.02, 2e-4))])
    loop = ("close-loop", path, "--effects", "viscous_damping", "--out", str(tmp_path / "loop"))
    both = [(("estimate", path), "friction"), (loop, "friction_after")]
    for command, named in both if stamps == "phone" else both[:1]:
        assert main([*command, *LINEAR, "--json"]) == 0
        found = json.loads(capsys.readouterr().out)[named]
        assert found["mean"] == pytest.approx(0.2, rel=2e-3)
    assert main(["estimate", path, *LINEAR, "--method", "envelope"]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert re.search(r"100 samples, 0\.0\d+ to 0\.\d+ s apart, 11\.\d+ Hz", shown)
    assert "a cubic spline brings the signal to an even grid" in shown


def test_ctrl_c_within_a_callback_of_c_is_no_defect(
    csv: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("friction_bayes.estimate", interrupted, raising=False)
    assert main(["estimate", str(csv), *LINEAR]) == 130
    assert capsys.readouterr().err == "friction-bayes: interrupted; nothing was written\n"
