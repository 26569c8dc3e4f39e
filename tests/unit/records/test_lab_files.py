"""Files as they lie in a laboratory: spreadsheets, archives, LabVIEW, dates of either order."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.core.errors import InputError
from friction_bayes.records.readers import archive, read_record
from friction_bayes.records.readers.clock_times import seconds_of_clock_times
from kinds_of_files import write_old_workbook, write_workbook

TIME = np.arange(120) * 0.05
SIGNAL = 0.01 * np.cos(8.0 * TIME) * (1.0 - TIME / 8.0)
ROWS = [(f"{t:.2f}", repr(float(x))) for t, x in zip(TIME, SIGNAL, strict=True)]
CSV = "time_s,displacement_m\n" + "\n".join(map(",".join, ROWS))


def test_a_spreadsheet_is_read_from_its_first_sheet_of_numbers(tmp_path: Path) -> None:
    pytest.importorskip("python_calamine")
    notes: list[list[str | float]] = [["made by", "a phone"], ["rate", 20.0]]
    rows = [
        ["Time (s)", "Position (mm)"],
        *([float(t), 1e3 * float(x)] for t, x in zip(TIME, SIGNAL, strict=True)),
    ]
    write_workbook(tmp_path / "swing.xlsx", {"Device": notes, "Raw Data": rows})
    record = read_record(tmp_path / "swing.xlsx")
    np.testing.assert_allclose(record.values, SIGNAL, atol=1e-15)
    np.testing.assert_allclose(record["time"], TIME, atol=1e-12)


def test_a_workbook_of_excel_97_is_read_as_the_new_ones(tmp_path: Path) -> None:
    pytest.importorskip("python_calamine")
    numbers = [[float(t), 1e3 * float(x)] for t, x in zip(TIME, SIGNAL, strict=True)]
    write_old_workbook(tmp_path / "swing.xls", [["Time (s)", "Position (mm)"], *numbers])
    record = read_record(tmp_path / "swing.xls")
    np.testing.assert_allclose(record.values, SIGNAL, atol=1e-15)
    np.testing.assert_allclose(record["time"], TIME, atol=1e-12)


def test_a_workbook_without_a_record_names_its_sheets(tmp_path: Path) -> None:
    pytest.importorskip("python_calamine")
    write_workbook(tmp_path / "notes.xlsx", {"Device": [["rate", 20.0]]})
    with pytest.raises(
        fb.InputError, match=r"notes\.xlsx: none of its sheets \(Device\) has 8 rows of numbers"
    ):
        read_record(tmp_path / "notes.xlsx")
    (tmp_path / "broken.xls").write_text("no workbook")
    with pytest.raises(fb.InputError, match="this is not a spreadsheet file"):
        read_record(tmp_path / "broken.xls")


def test_a_phyphox_archive_is_read_without_its_notes(tmp_path: Path) -> None:
    path = tmp_path / "export.zip"
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("Raw Data.csv", CSV)
        made.writestr("meta/device.csv", '"property","value"\n')
    np.testing.assert_array_equal(read_record(path).values, SIGNAL)
    with zipfile.ZipFile(path, "a") as made:
        made.writestr("second.csv", CSV)
    with pytest.raises(fb.InputError, match=r"several tables: Raw Data\.csv, second\.csv; take out the one"):
        read_record(path)


def test_an_archive_that_would_fill_the_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "export.zip"
    with zipfile.ZipFile(path, "w") as made:
        made.writestr("Raw Data.csv", CSV)
    monkeypatch.setattr(archive, "_MOST_BYTES", len(CSV) - 1)
    with pytest.raises(fb.InputError, match=r"unpacks to 0 MB, more than 0"):
        read_record(path)
    path.write_text("no archive")
    with pytest.raises(fb.InputError, match="this is not a ZIP file"):
        read_record(path)


def test_labview_writes_its_time_as_x_value(tmp_path: Path) -> None:
    path = tmp_path / "swing.lvm"
    head = "LabVIEW Measurement\t\nX_Columns\tOne\t\n***End_of_Header***\t\n\t\nChannels\t1\t\n"
    rows = "".join(f"{t}\t{x}\t\n" for t, x in ROWS)
    path.write_text(
        f"{head}Delta_X\t0.05\t\n***End_of_Header***\t\t\nX_Value\tDisplacement\tComment\t\n{rows}"
    )
    np.testing.assert_array_equal(read_record(path, unit="m").values, SIGNAL)


@pytest.mark.parametrize("separator", ["\t", ","], ids=["tabs", "commas"])
@pytest.mark.parametrize("columns", ["One", "No"])
@pytest.mark.parametrize("name", ["Displacement", "Untitled"])
def test_labview_states_units_and_times_in_its_header(
    separator: str, columns: str, name: str, tmp_path: Path
) -> None:
    path = tmp_path / "swing.lvm"
    head = [
        ["LabVIEW Measurement", ""],
        ["Separator", {"\t": "Tab", ",": "Comma"}[separator]],
        ["X_Columns", columns],
        ["***End_of_Header***", ""],
        ["Channels", "1", ""],
        ["Y_Unit_Label", "Millimeters", ""],
        ["X_Unit_Label", "ms", ""],
        ["X0", "3000.0", ""],
        ["Delta_X", f"{1e3 * float(TIME[1] - TIME[0])!r}", ""],
        ["***End_of_Header***", "", ""],
        ["X_Value", name, "Comment"],
    ]
    rows = [[f"{3e3 + 1e3 * float(t)!r}" if columns == "One" else "", x] for t, x in ROWS]
    path.write_text("".join(separator.join(cells) + "\n" for cells in head + rows))
    found = read_record(path)
    np.testing.assert_allclose(found.values, 1e-3 * SIGNAL, rtol=1e-15)
    np.testing.assert_allclose(found["time"], 3.0 + TIME - TIME[0], atol=1e-12)
    with pytest.raises(fb.InputError, match="is in mm, unit says m"):
        read_record(path, unit="m")


def test_labview_channels_of_several_intervals_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "swing.lvm"
    head = "LabVIEW Measurement\t\nX_Columns\tNo\n***End_of_Header***\t\nDelta_X\t0.05\t0.1\n"
    rows = "".join(f"\t0\t{x}\n" for _, x in ROWS)
    path.write_text(f"{head}***End_of_Header***\t\nX_Value\tforce\tdisplacement_m\n{rows}")
    with pytest.raises(fb.InputError, match=r"several intervals, 0\.05 and 0\.1"):
        read_record(path)


@pytest.mark.parametrize(("decimal", "thousands"), [(",", "."), (".", ",")])
def test_numbers_in_thousands_are_not_taken_for_decimals(
    tmp_path: Path, decimal: str, thousands: str
) -> None:
    path = tmp_path / "swing.csv"
    values = [f"{500_000 + 1e6 * float(x):,.0f}".replace(",", thousands) for _, x in ROWS]
    times = [str(t).replace(".", decimal) for t, _ in ROWS]
    lines = [f"{time};{value}\n" for time, value in zip(times, values, strict=True)]
    path.write_text("time_s;displacement_um\n" + "".join(lines))
    with pytest.raises(fb.InputError, match=rf"row 2: column displacement_um: {values[0]} is in thousands"):
        read_record(path)


@pytest.mark.parametrize(
    "coded",
    [
        lambda text: text.encode("utf-16-le"),
        lambda text: text.encode("utf-16-be"),
        lambda text: text.replace("\n", "\n------,---------\n", 1).encode(),
        lambda text: text.replace("\n", "\n+=====+=====+\n", 1).encode(),
    ],
    ids=["utf-16-le", "utf-16-be", "dashed rule", "table rule"],
)
def test_text_without_a_mark_and_rules_under_the_header(
    tmp_path: Path, coded: Callable[[str], bytes]
) -> None:
    path = tmp_path / "swing.csv"
    path.write_bytes(coded(CSV))
    np.testing.assert_array_equal(read_record(path).values, SIGNAL)


@pytest.mark.parametrize("header", ["Time (s)   Position (m)", "Time (s) Position (m)", "Time [s]    x [m]"])
@pytest.mark.parametrize("rule", ["", "--------   ------------\n"])
def test_names_among_blanks_keep_their_units(tmp_path: Path, header: str, rule: str) -> None:
    path = tmp_path / "swing.txt"
    path.write_text(f"{header}\n{rule}" + "\n".join("   ".join(row) for row in ROWS))
    np.testing.assert_array_equal(read_record(path).values, SIGNAL)


@pytest.mark.parametrize("form", ["%d.%m.%Y %H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y, %H:%M:%S.%f"])
@pytest.mark.parametrize("start", [datetime(2024, 3, 1, 23, 59, 58), datetime(2024, 12, 31, 11, 0, 0)])
def test_dates_of_either_order_go_on_beyond_midnight(form: str, start: datetime) -> None:
    cells = [(start + timedelta(seconds=float(t))).strftime(form) for t in TIME]
    found = seconds_of_clock_times(cells)
    assert found is not None
    np.testing.assert_allclose(found, TIME, atol=1e-9)


def test_a_time_zone_may_change_where_summer_time_begins(tmp_path: Path) -> None:
    path = tmp_path / "swing.csv"
    rows = [(datetime(2024, 3, 31, 0, 59, 59, tzinfo=UTC) + timedelta(seconds=float(t)), x) for t, x in ROWS]
    zones = [timezone(timedelta(hours=1 + (time.hour >= 1))) for time, _ in rows]
    lines = [f"{t.astimezone(zone).isoformat()},{x}\n" for zone, (t, x) in zip(zones, rows, strict=True)]
    path.write_text("Time,displacement_m\n" + "".join(lines))
    assert len(set(zones)) == 2
    np.testing.assert_allclose(read_record(path)["time"], TIME - TIME[0], atol=1e-5)


def test_doubled_stamps_take_the_first_or_the_mean(tmp_path: Path) -> None:
    path = tmp_path / "swing.csv"
    doubled = [row for t, x in ROWS for row in (f"{t},{x}", f"{t},{float(x) + 2e-4!r}")]
    path.write_text("time_s,displacement_m\n" + "\n".join(doubled))
    with pytest.raises(fb.InputError, match=r"time is doubled at row 3 .*duplicates=first or mean"):
        read_record(path)
    np.testing.assert_array_equal(read_record(path, duplicates="first").values, SIGNAL)
    np.testing.assert_allclose(read_record(path, duplicates="mean").values, SIGNAL + 1e-4, atol=1e-15)
    with pytest.raises(fb.InputError, match="duplicates: 'last' is unknown; give first or mean"):
        read_record(path, duplicates="last")


def test_a_unit_alone_says_what_the_one_signal_measures(tmp_path: Path) -> None:
    path = tmp_path / "swing.csv"
    path.write_text(CSV.replace("displacement_m", "position"))
    assert read_record(path, unit="deg").attrs["quantity"] == "angle"
    assert read_record(path, unit="mm").attrs["quantity"] == "displacement"
    assert read_record(path, unit="counts/rad", scale=600.0).attrs["quantity"] == "angle"
    with pytest.raises(fb.InputError, match="no column says what was measured"):
        read_record(path, unit="V")


def test_members_of_a_struct_are_found_by_their_own_names(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "swing.mat", {"log": {"Out": {"Time": TIME, "angle_rad": SIGNAL}}})
    record = read_record(tmp_path / "swing.mat")
    assert record.attrs["read"] == "log.Out.angle_rad [rad] over log.Out.Time [s]"


@pytest.mark.parametrize("separator", ["\t", ";", ","])
def test_names_may_be_separated_otherwise_than_the_numbers(tmp_path: Path, separator: str) -> None:
    path = tmp_path / "decay.txt"
    path.write_text("t       y\n" + "\n".join(separator.join(row) for row in ROWS))
    record = read_record(path, signal_column="y", quantity="displacement", unit="m")
    assert record.attrs["read"] == "y [m] over t [s]"
    np.testing.assert_allclose(record.values, SIGNAL, atol=1e-15)


def test_a_title_of_as_many_words_names_no_columns(tmp_path: Path) -> None:
    path = tmp_path / "decay.txt"
    path.write_text("Pendulum today\n" + "\n".join("\t".join(row) for row in ROWS))
    with pytest.raises(InputError, match="there is no header line above the numbers of column 0, 1"):
        read_record(path)


def test_columns_without_a_header_are_said_to_be_columns(tmp_path: Path) -> None:
    path = tmp_path / "bare.txt"
    path.write_text("\n".join(map(" ".join, ROWS)))
    record = fb.read_record(path, time_column="0", signal_column="1", quantity="displacement", unit="mm")
    assert record.attrs["read"] == "column 1 [mm] over column 0 [s]"
