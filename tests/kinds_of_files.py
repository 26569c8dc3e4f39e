"""Files of the kinds that laboratories have, small and synthetic, with what becomes of each.

All hold one decay: 10 kg, 1000 N/m, 0.5 N of friction, five seconds at 100 Hz. Run as a program, with the
folder of the package on the path, it writes the page of the documentation.
"""

from __future__ import annotations

import inspect
import shlex
import struct
import zipfile
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from decays import written_decay
from friction_bayes.core.arrays import Array

__all__ = [
    "FRICTION",
    "KINDS",
    "Kind",
    "arduino",
    "page",
    "phyphox",
    "tracker_project",
    "write_old_workbook",
    "write_workbook",
]

FRICTION = 0.5
"""[N], or [N m] of the same numbers as a rotor."""
RATE = 100.0
TIME = np.arange(500) / RATE
SIGNAL = written_decay(TIME, 0.02, 5e-4) + np.random.default_rng(33).normal(0.0, 1e-6, TIME.size)

LINEAR = ("--mass", "10", "--stiffness", "1000")
ROTARY = ("--inertia", "10", "--stiffness", "1000")
DISPLACEMENT = ("--quantity", "displacement", "--unit")


class Kind(NamedTuple):
    """A kind of file, what is said of it on the command line, and what comes of it.

    Attributes
    ----------
    write : callable
        Writes it to a path.
    name : str
        Of the file.
    says : str
        What was read, or the words of the refusal.
    stated : tuple of str
        Options.
    system : tuple of str
    read : bool
    """

    write: Callable[[Path], object]
    name: str
    says: str
    stated: tuple[str, ...] = ()
    system: tuple[str, ...] = LINEAR
    read: bool = True


def _rows(time: Iterable[object], signal: Iterable[float], separator: str = ",") -> list[str]:
    times = (f"{t:.9g}" if isinstance(t, float) else str(t) for t in time)
    return [f"{t}{separator}{x:.9g}" for t, x in zip(times, signal, strict=True)]


PLAIN = _rows(TIME, SIGNAL)


def _lines(*lines: str, coding: str = "utf-8") -> Callable[[Path], object]:
    return lambda path: path.write_bytes(("\n".join(lines) + "\n").encode(coding))


def _bytes(content: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(content)


def _zipped(**members: str) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as made:
            for name, content in members.items():
                made.writestr(name, content)

    return write


def phyphox(time: Array, signal: Array) -> list[str]:
    """Rows of the gyroscope of a phone."""
    rate = np.gradient(signal, time)
    header = '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"'
    return [header, *(f"{t:.9E},{r:.9E},1E-3,2E-3,{abs(r):.9E}" for t, r in zip(time, rate, strict=True))]


def arduino(time: Array, signal: Array) -> list[str]:
    """Milliseconds and micrometres under a greeting, without names."""
    return ["Ready.", *_rows(np.round(1e3 * time), np.round(1e6 * signal), " ")]


def _oscilloscope() -> list[str]:
    """Settings, header, units, a blank line, decimal commas, and a separator at each line's end."""
    above = ["Model;DL850;", "Date;2024/03/01;", "Samples;500;", "Note: spring; released by hand", ""]
    table = [row.replace(".", ",") + ";" for row in _rows(1e3 * TIME, 1e3 * SIGNAL, ";")]
    return [*above, "Time;Position;", "(ms);(mm);", "", *table]


def _labview() -> list[str]:
    head = ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tOne", "***End_of_Header***\t", "\t"]
    above = [*head, "Channels\t1\t", "Delta_X\t0.01\t", "***End_of_Header***\t\t"]
    return [*above, "X_Value\tDisplacement\tComment\t", *(row + "\t" for row in _rows(TIME, SIGNAL, "\t"))]


def _labview_without_times() -> list[str]:
    """As ``Write to Measurement File`` leaves the time column empty and the unit in the header."""
    head = ["LabVIEW Measurement\t", "Separator\tTab", "X_Columns\tNo", "***End_of_Header***\t", "\t"]
    above = [*head, "Channels\t1\t", "Y_Unit_Label\tMillimeters\t", "X0\t0.0\t", "Delta_X\t0.01\t"]
    rows = [f"\t{value}" for value in 1e3 * SIGNAL]
    return [*above, "***End_of_Header***\t\t", "X_Value\tUntitled\tComment\t", *rows]


def _pasco() -> list[str]:
    header = ",".join(f"Time (s) Run #{k},Position (m) Run #{k}" for k in (1, 2))
    second = _rows(TIME[:400], SIGNAL[:400]) + [","] * 100
    return [header, *map(",".join, zip(PLAIN, second, strict=True))]


def _dated(form: str, start: datetime) -> list[str]:
    return [(start + timedelta(seconds=float(t))).strftime(form) for t in TIME]


def _event_log() -> list[str]:
    """A row only where the count of an encoder changes: 0.1 mm each."""
    time = np.arange(100_000) / 20_000.0
    counts = np.floor(written_decay(time, 0.02, 5e-4) / 1e-4)
    changes = np.flatnonzero(np.diff(counts)) + 1
    return ["time_s,displacement_mm", *_rows(time[changes], 0.1 * counts[changes])]


def _doubled() -> list[str]:
    """A logger that writes twice at each tick of its clock."""
    return ["time_s,displacement_m", *(row for each in PLAIN for row in (each, each))]


def _mat(path: Path, **content: object) -> None:
    from scipy.io import savemat

    savemat(path, content)


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        file["run/time_s"] = TIME
        file["run/displacement_m"] = SIGNAL[:, None]
    if path.suffix == ".mat":
        with path.open("r+b") as opened:
            # a MAT file of version 7.3 is HDF5 behind this header
            opened.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _netcdf(path: Path) -> None:
    import friction_bayes as fb

    fb.write_record(fb.make_record(TIME, SIGNAL, "displacement"), path)


def _wav(path: Path) -> None:
    samples = np.round(1e6 * SIGNAL).astype("<i2").tobytes()
    form = struct.pack("<HHIIHH", 1, 1, int(RATE), 2 * int(RATE), 2, 16)
    chunks = b"fmt " + struct.pack("<I", 16) + form + b"data" + struct.pack("<I", len(samples)) + samples
    path.write_bytes(b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks)


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    timing = {"wf_increment": 1.0 / RATE, "wf_samples": TIME.size, "unit_string": "mm"}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("rig", "displacement", 1e3 * SIGNAL, properties=timing)])


def _uff(path: Path) -> None:
    import pyuff

    fields = inspect.signature(pyuff.prepare_58).parameters.keys() - {"return_full_dict"}
    texts = ("ent_name", "lab", "id1", "id2", "id3", "id4", "id5")
    content: dict[str, Any] = {field: "none" if field.endswith(texts) else 0 for field in fields}
    content |= {"type": 58, "func_type": 1, "ord_data_type": 4, "num_pts": TIME.size}
    content |= {"data": 1e3 * SIGNAL, "x": TIME, "abscissa_spacing": 1, "abscissa_inc": 1.0 / RATE}
    content |= {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "mm"}
    pyuff.UFF(str(path)).write_sets(content, "overwrite")


def _mf4(path: Path) -> None:
    import asammdf

    with asammdf.MDF() as file:
        file.append([asammdf.Signal(1e3 * SIGNAL, TIME, name="displacement", unit="mm")])
        file.save(path)


_SHEET = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_RELATION = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_TYPES = "application/vnd.openxmlformats-officedocument.spreadsheetml"


def write_workbook(path: Path, sheets: dict[str, list[list[str | float]]]) -> None:
    """Write the least that a spreadsheet program opens."""
    numbers = range(1, len(sheets) + 1)
    types = "".join(
        f'<Override PartName="/xl/worksheets/sheet{k}.xml" ContentType="{_TYPES}.worksheet+xml"/>'
        for k in numbers
    )
    names = "".join(
        f'<sheet name="{name}" sheetId="{k}" r:id="r{k}"/>' for k, name in zip(numbers, sheets, strict=True)
    )
    links = "".join(
        f'<Relationship Id="r{k}" Type="{_RELATION}/worksheet" Target="worksheets/sheet{k}.xml"/>'
        for k in numbers
    )
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{_PACKAGE}/content-types"><Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Override PartName='
        f'"/xl/workbook.xml" ContentType="{_TYPES}.sheet.main+xml"/>{types}</Types>',
        "_rels/.rels": f'<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="r0" '
        f'Type="{_RELATION}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{_SHEET}" xmlns:r="{_RELATION}"><sheets>{names}</sheets>'
        "</workbook>",
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{_PACKAGE}/relationships">{links}'
        "</Relationships>",
    }
    for k, rows in zip(numbers, sheets.values(), strict=True):
        body = "".join(f"<row>{''.join(map(_cell, row))}</row>" for row in rows)
        parts[f"xl/worksheets/sheet{k}.xml"] = (
            f'<worksheet xmlns="{_SHEET}"><sheetData>{body}</sheetData></worksheet>'
        )
    _zipped(**{name: f'<?xml version="1.0"?>{content}' for name, content in parts.items()})(path)


def write_old_workbook(path: Path, rows: list[list[str | float]]) -> None:
    """Write the least that is a workbook of Excel 97: one BIFF8 stream in a compound file."""

    def record(kind: int, content: bytes) -> bytes:
        return struct.pack("<HH", kind, len(content)) + content

    def cell(row: int, column: int, value: str | float) -> bytes:
        place = struct.pack("<HHH", row, column, 0)
        if isinstance(value, str):
            return record(0x0204, place + struct.pack("<HB", len(value), 0) + value.encode("latin-1"))
        return record(0x0203, place + struct.pack("<d", value))

    def beginning(kind: int) -> bytes:
        return record(0x0809, struct.pack("<HHHHII", 0x0600, kind, 0x0DBB, 0x07CC, 0, 6))

    end, name = record(0x000A, b""), b"Sheet1"
    start = len(beginning(5)) + 4 + 8 + len(name) + len(end)
    book = beginning(5) + record(0x0085, struct.pack("<IHBB", start, 0, len(name), 0) + name) + end
    cells = [cell(i, j, value) for i, row in enumerate(rows) for j, value in enumerate(row)]
    book += beginning(0x10) + b"".join(cells) + end
    # a stream of 4096 bytes and more lies in sectors of its own
    book = book.ljust(max(4096, -(-len(book) // 512) * 512), b"\0")
    sectors = len(book) // 512
    chain = [0xFFFFFFFD, 0xFFFFFFFE, *range(3, sectors + 2), 0xFFFFFFFE]
    table = struct.pack(f"<{len(chain)}I", *chain).ljust(512, b"\xff")
    assert len(table) == 512

    def entry(title: str, kind: int, child: int, first: int, size: int) -> bytes:
        text = title.encode("utf-16-le") + b"\0\0"
        links = struct.pack("<BBIII", kind, 1, 0xFFFFFFFF, 0xFFFFFFFF, child)
        return (
            text.ljust(64, b"\0")
            + struct.pack("<H", len(text))
            + links
            + bytes(36)
            + struct.pack("<IQ", first, size)
        )

    directory = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0) + entry("Workbook", 2, 0xFFFFFFFF, 2, len(book))
    header = (
        bytes.fromhex("d0cf11e0a1b11ae1") + bytes(16) + struct.pack("<HHHHH", 62, 3, 0xFFFE, 9, 6) + bytes(6)
    )
    header += struct.pack("<IIIIIIIII", 0, 1, 1, 0, 4096, 0xFFFFFFFE, 0, 0xFFFFFFFE, 0)
    header += struct.pack("<109I", 0, *[0xFFFFFFFF] * 108)
    path.write_bytes(header + table + directory.ljust(512, b"\0") + book)


def _cell(value: str | float) -> str:
    return f'<c t="str"><v>{value}</v></c>' if isinstance(value, str) else f"<c><v>{value!r}</v></c>"


def _table_of_numbers(*header: str) -> list[list[str | float]]:
    return [[*header], *([float(t), 1e3 * float(x)] for t, x in zip(TIME, SIGNAL, strict=True))]


def _xlsx(*header: str) -> Callable[[Path], object]:
    notes: list[list[str | float]] = [["made by", "a phone"], ["rate", RATE]]
    return lambda path: write_workbook(path, {"Device": notes, "Raw Data": _table_of_numbers(*header)})


def _ods(path: Path) -> None:
    """A table kept by hand, with a title above it."""
    name = "urn:oasis:names:tc:opendocument:xmlns:"

    def cell(value: str | float) -> str:
        kind = "string" if isinstance(value, str) else "float"
        number = "" if isinstance(value, str) else f' office:value="{value!r}"'
        cells = f'<table:table-cell office:value-type="{kind}"{number}>'
        return f"{cells}<text:p>{value}</text:p></table:table-cell>"

    rows = [["Pendulum in the cellar"], *_table_of_numbers("Zeit [s]", "Weg [mm]")]
    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
    content = (
        f'<office:document-content xmlns:office="{name}office:1.0" xmlns:table="{name}table:1.0" '
        f'xmlns:text="{name}text:1.0"><office:body><office:spreadsheet><table:table table:name="one">{body}'
        "</table:table></office:spreadsheet></office:body></office:document-content>"
    )
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    manifest = (
        f'<manifest:manifest xmlns:manifest="{name}manifest:1.0"><manifest:file-entry manifest:full-path="/" '
        f'manifest:media-type="{kind}"/></manifest:manifest>'
    )
    _zipped(**{"mimetype": kind, "META-INF/manifest.xml": manifest, "content.xml": content})(path)


_TRACKER = "org.opensourcephysics.cabrillo.tracker"


def _property(name: str, content: object, kind: str = "double") -> str:
    return f'<property name="{name}" type="{kind}">{content}</property>'


def _thing(name: str, cls: str, *content: str) -> str:
    return _property(name, f'<object class="{cls}">{"".join(content)}</object>', "object")


def tracker_project(
    frames: Array,
    signal: Array,
    *,
    angle: float = 0.0,
    scale: object = 200.0,
    step: object = 40.0,
    unit: str | None = "m",
) -> str:
    """Return a project with a mass that moves along the x-axis of a system turned by an angle [degree]."""
    along = np.array([np.cos(np.radians(angle)), -np.sin(np.radians(angle))])
    marks = [
        _thing(
            f"[{n}]",
            f"{_TRACKER}.PointMass$FrameData",
            _property("x", 320.0 + px),
            _property("y", 240.0 + py),
        )
        for n, (px, py) in zip(frames.tolist(), (200.0 * signal[:, None] * along).tolist(), strict=True)
    ]
    system = (
        _property("xorigin", 320.0),
        _property("yorigin", 240.0),
        _property("angle", angle),
        _property("xscale", scale),
        _property("yscale", scale),
    )
    axes = _thing("item", f"{_TRACKER}.CoordAxes", _property("name", "axes", "string"))
    mass = _thing(
        "item",
        f"{_TRACKER}.PointMass",
        _property("name", "bob", "string"),
        _property("framedata", "".join(marks), "array"),
    )
    return "".join(
        (
            f'<?xml version="1.0" encoding="UTF-8"?><object class="{_TRACKER}.TrackerPanel">',
            _thing("videoclip", f"{_TRACKER}.VideoClip", _property("startframe", int(frames[0]), "int")),
            _thing("clipcontrol", f"{_TRACKER}.StepperClipControl", _property("delta_t", step)),
            _thing(
                "coords",
                f"{_TRACKER}.ImageCoordSystem",
                _property("framedata", _thing("[0]", "FrameData", *system), "array"),
            ),
            "" if unit is None else _property("length_unit", unit, "string"),
            _property("tracks", axes + mass, "collection"),
            "</object>",
        )
    )


def _npy(path: Path) -> None:
    np.save(path, SIGNAL)


_GERMAN = [row.replace(".", ",") for row in _rows(TIME, 1e3 * SIGNAL, ";")]
_EVENING = datetime(2024, 2, 29, 23, 59, 58)
_DEVICE = '"property","value"\n'

KINDS: dict[str, Kind] = {
    "a header with units in the names": Kind(
        _lines("time_s,displacement_m", *PLAIN), "own.csv", "displacement_m [m] over time_s [s]"
    ),
    "semicolons and decimal commas": Kind(
        _lines("Zeit [s];Weg [mm]", *_GERMAN), "german.csv", "Weg [mm] over Zeit [s]"
    ),
    "tabs, in a file called .dat": Kind(
        _lines("Time (s)\tPosition (mm)", *_rows(TIME, 1e3 * SIGNAL, "\t")),
        "logger.dat",
        "Position (mm) [mm] over Time (s) [s]",
    ),
    "tabs, in a file called .tsv": Kind(
        _lines("t / s\tx / cm", *_rows(TIME, 1e2 * SIGNAL, "\t")), "export.tsv", "x / cm [cm] over t / s [s]"
    ),
    "numbers alone, from an Arduino": Kind(
        _lines(*arduino(TIME, SIGNAL)),
        "arduino.txt",
        "column 1 [um] at the given 100 Hz",
        ("--sampling-rate", "100", "--signal-column", "1", *DISPLACEMENT, "um"),
    ),
    "numpy.savetxt, names on a comment": Kind(
        _lines("# time_s displacement_m", *_rows(TIME, SIGNAL, " ")),
        "saved.txt",
        "displacement_m [m] over time_s [s]",
    ),
    "a dashed rule under the header": Kind(
        _lines("time_s  displacement_m", "------  --------------", *_rows(TIME, SIGNAL, "  ")),
        "ruled.txt",
        "displacement_m [m] over time_s [s]",
    ),
    "UTF-16 with a mark": Kind(
        _lines("Time (s)\tPosition (m)", *_rows(TIME, SIGNAL, "\t"), coding="utf-16"),
        "marked.txt",
        "Position (m) [m] over Time (s) [s]",
    ),
    "UTF-16 without a mark": Kind(
        _lines("Time (s)\tPosition (m)", *_rows(TIME, SIGNAL, "\t"), coding="utf-16-le"),
        "unmarked.txt",
        "Position (m) [m] over Time (s) [s]",
    ),
    "an oscilloscope, settings and units above": Kind(
        _lines(*_oscilloscope()), "scope.csv", "Position (mm) [mm] over Time (ms) [ms]"
    ),
    "LabVIEW .lvm": Kind(
        _lines(*_labview()), "rig.lvm", "Displacement [m] over X_Value [s]", ("--unit", "m")
    ),
    "LabVIEW .lvm, called .txt": Kind(
        _lines(*_labview()), "rig.txt", "Displacement [m] over X_Value [s]", ("--unit", "m")
    ),
    "LabVIEW .lvm, unit and times in its header": Kind(
        _lines(*_labview_without_times()), "shaker.lvm", "Untitled [mm] over X_Value [s]"
    ),
    "PASCO Capstone, two runs": Kind(
        _lines(*_pasco()), "capstone.csv", "Position (m) [m] over Time (s) [s]", ("--run", "1")
    ),
    "Physics Toolbox, in g": Kind(
        _lines("time,gFx", *_rows(TIME, np.gradient(np.gradient(SIGNAL, TIME), TIME) / 9.80665)),
        "phone.csv",
        "gFx [g] over time [s]",
    ),
    "phyphox, CSV": Kind(
        _lines(*phyphox(TIME, SIGNAL)),
        "gyroscope.csv",
        "Gyroscope x (rad/s) [rad/s] over Time (s) [s]",
        ("--signal-column", "Gyroscope x (rad/s)"),
        ROTARY,
    ),
    "phyphox, archive": Kind(
        _zipped(**{"Raw Data.csv": "\n".join(phyphox(TIME, SIGNAL)), "meta/device.csv": _DEVICE}),
        "export.zip",
        "Gyroscope x (rad/s) [rad/s] over Time (s) [s]",
        ("--signal-column", "Gyroscope x (rad/s)"),
        ROTARY,
    ),
    "phyphox, Excel": Kind(
        _xlsx("Time (s)", "Position (mm)"), "phyphox.xlsx", "Position (mm) [mm] over Time (s) [s]"
    ),
    "a table kept by hand, OpenDocument": Kind(_ods, "kept.ods", "Weg [mm] over Zeit [s]"),
    "Tracker, exported": Kind(
        _lines("mass_A", "t,x,y", *(f"{row},0.5" for row in PLAIN), ""),
        "mass_A.txt",
        "x [m] over t [s]",
        ("--signal-column", "x", *DISPLACEMENT, "m"),
    ),
    "Tracker, project": Kind(
        lambda path: path.write_text(tracker_project(np.arange(500), SIGNAL, step=10.0)),
        "video.trk",
        "bob x [m] over the times of its channel",
        ("--signal-column", "bob x"),
    ),
    "times of the day, past midnight": Kind(
        _lines("Time;Position (m)", *_rows(_dated("%H:%M:%S.%f", _EVENING), SIGNAL, ";")),
        "clock.csv",
        "Position (m) [m] over Time [s since 23:59:58.000000]",
    ),
    "dates, the day first": Kind(
        _lines("Zeit;Position (m)", *_rows(_dated("%d.%m.%Y %H:%M:%S.%f", _EVENING), SIGNAL, ";")),
        "dated.csv",
        "Position (m) [m] over Zeit [s since 29.02.2024 23:59:58.000000]",
    ),
    "an encoder's events": Kind(_lines(*_event_log()), "encoder.csv", "displacement_mm [mm] over time_s [s]"),
    "two rows at each stamp": Kind(
        _lines(*_doubled()),
        "doubled.csv",
        "displacement_m [m] over time_s [s]",
        ("--duplicates", "first"),
    ),
    "MAT, times in a struct": Kind(
        lambda path: _mat(path, HIdata={"time": TIME[:, None], "displacement_m": SIGNAL[:, None]}),
        "hidata.mat",
        "HIdata.displacement_m [m] over HIdata.time [s]",
    ),
    "MAT, times two structs deep": Kind(
        lambda path: _mat(path, Al={"Out": {"Time": TIME, "position": SIGNAL}}),
        "simulink.mat",
        "Al.Out.position [m] over Al.Out.Time [s]",
        ("--unit", "m"),
    ),
    "MAT 7.3": Kind(_hdf5, "large.mat", "run/displacement_m [m] over run/time_s [s]"),
    "HDF5": Kind(_hdf5, "store.hdf5", "run/displacement_m [m] over run/time_s [s]"),
    "NetCDF": Kind(_netcdf, "record.nc", "displacement [m] over time [s]"),
    "WAV": Kind(
        _wav,
        "laser.wav",
        "column 0 [um] over the times of its channel",
        (*DISPLACEMENT, "um", "--scale", "1"),
    ),
    "TDMS": Kind(_tdms, "daq.tdms", "rig/displacement [mm] over the times of its channel"),
    "universal file, data set 58": Kind(_uff, "modal.unv", "column 0 [mm] over the times of its channel"),
    "MF4": Kind(_mf4, "bus.mf4", "displacement [mm] over the times of its channel"),
    "two rows at each stamp, nothing said": Kind(
        _lines(*_doubled()), "logger.csv", "time is doubled at row 3", read=False
    ),
    "volts without a sensitivity": Kind(
        _lines("Time (s),Output Voltage (V)", *PLAIN),
        "voltage.csv",
        "no column says what was measured",
        read=False,
    ),
    "an archive of two tables": Kind(
        _zipped(**{"one.csv": "\n".join(PLAIN), "two.csv": "\n".join(PLAIN)}),
        "two.zip",
        "several tables: one.csv, two.csv",
        read=False,
    ),
    "a picture called .csv": Kind(
        _bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), "picture.csv", "this is not a text file", read=False
    ),
    "a NumPy array": Kind(_npy, "array.npy", "unknown suffix '.npy'", read=False),
}
"""By what they are called."""


_PAGE = """# Kinds of files

What becomes of {many} small synthetic files of one decay, as tests hold it. What is read is as
`friction-bayes` prints it; what is refused is in quotes, from the one line that is printed instead. How
columns, units and times are found is under [file formats](data.md#file-formats).

| file | of the kind | given in addition | what is read, or why not |
|---|---|---|---|
{rows}
"""


def page() -> str:
    """Return the page of the documentation that lists them."""
    rows = [
        f"| `{kind.name}` | {what} | {f'`{shlex.join(kind.stated)}`' if kind.stated else ''} "
        f"| {kind.says if kind.read else f'“{kind.says}”'} |"
        for what, kind in KINDS.items()
    ]
    return _PAGE.format(many=len(KINDS), rows="\n".join(rows))


if __name__ == "__main__":
    (Path(__file__).parents[1] / "docs" / "kinds_of_files.md").write_text(page(), encoding="utf-8")
