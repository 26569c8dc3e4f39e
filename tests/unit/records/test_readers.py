"""Files of every format: what is read, and what is refused in which words."""

from __future__ import annotations

import inspect
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat, wavfile

from friction_bayes.core import optional
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.estimators.stack import as_stack
from friction_bayes.records.clock import check_time_unit
from friction_bayes.records.fleet import open_fleet
from friction_bayes.records.readers import READERS, Column, Table, read_record
from friction_bayes.records.readers.text import TEXT_SUFFIXES
from friction_bayes.records.record import make_record, validate_record
from friction_bayes.records.writers import write_record

N, RATE = 120, 100
TIME = np.arange(N) / RATE
SIGNAL = 0.01 * np.cos(10.0 * TIME) * (1.0 - TIME / 2.0)
ROWS = [f"{t!r},{x!r}" for t, x in zip(TIME.tolist(), SIGNAL.tolist(), strict=True)]


def save(folder, rows, header="time_s,displacement_m", *, encoding="utf-8", newline="\n", name="decay.csv"):
    path = folder / name
    lines = ([header] if header is not None else []) + list(rows)
    path.write_bytes((newline.join(lines) + newline).encode(encoding))
    return path


def assert_is_the_signal(record, *, quantity="displacement", unit="m", scale=1.0, rtol=0.0):
    assert record.attrs["quantity"] == quantity
    assert record.attrs["units"] == unit
    np.testing.assert_allclose(record["time"].values, TIME, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(record.values, SIGNAL * scale, rtol=rtol or 1e-15)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_encodings_and_line_ends(tmp_path, encoding, newline) -> None:
    record = read_record(save(tmp_path, ROWS, encoding=encoding, newline=newline))
    assert_is_the_signal(record)
    assert record.attrs["name"] == "decay.csv"


@pytest.mark.parametrize("separator", [";", "\t", ", ", " "])
def test_separators(tmp_path, separator) -> None:
    rows = [row.replace(",", separator) for row in ROWS]
    assert_is_the_signal(read_record(save(tmp_path, rows, f"time_s{separator}displacement_m")))


@pytest.mark.parametrize("separator", [";", "\t"])
def test_decimal_commas(tmp_path, separator) -> None:
    rows = [row.replace(",", separator).replace(".", ",") for row in ROWS]
    assert_is_the_signal(read_record(save(tmp_path, rows, f"time_s{separator}displacement_m")))


def test_comments_blank_lines_quotes_and_trailing_separators(tmp_path) -> None:
    rows = [row.replace(",", ";") + ";" for row in ROWS]
    text = [
        "# a note",
        "",
        '"time_s";"displacement_m";',
        *rows[:50],
        "# half way",
        "",
        *rows[50:],
        "",
        "  ",
        "",
    ]
    assert_is_the_signal(read_record(save(tmp_path, text, None)))


def test_other_columns_are_left_alone(tmp_path) -> None:
    rows = [f"x{k},{row},n/a" for k, row in enumerate(ROWS)]
    assert_is_the_signal(read_record(save(tmp_path, rows, "label,time_s,displacement_m,remark")))


@pytest.mark.parametrize(
    ("column", "quantity", "unit", "scale"),
    [
        ("displacement_mm", "displacement", "m", 1e-3),
        ("velocity_m_s", "velocity", "m/s", 1.0),
        ("acceleration_m_s2", "acceleration", "m/s2", 1.0),
        ("acceleration_g", "acceleration", "m/s2", STANDARD_GRAVITY),
        ("angle_rad", "angle", "rad", 1.0),
        ("angle_deg", "angle", "rad", np.pi / 180.0),
        ("angular_velocity_rad_s", "angular_velocity", "rad/s", 1.0),
        ("angular_velocity_deg_s", "angular_velocity", "rad/s", np.pi / 180.0),
        ("angular_acceleration_rad_s2", "angular_acceleration", "rad/s2", 1.0),
        ("angular_velocity_V", "angular_velocity", "V", 1.0),
        ("acceleration_mV", "acceleration", "mV", 1.0),
    ],
)
def test_column_names_carry_quantity_and_unit(tmp_path, column, quantity, unit, scale) -> None:
    record = read_record(save(tmp_path, ROWS, f"time_s,{column}"))
    assert_is_the_signal(record, quantity=quantity, unit=unit, scale=scale)


def test_time_in_milliseconds(tmp_path) -> None:
    rows = [f"{1e3 * t!r},{x!r}" for t, x in zip(TIME.tolist(), SIGNAL.tolist(), strict=True)]
    assert_is_the_signal(read_record(save(tmp_path, rows, "time_ms,displacement_m")))


def test_options_tell_what_names_do_not(tmp_path) -> None:
    named = save(tmp_path, ROWS, "t,x")
    stated = {"quantity": "angle", "unit": "deg"}
    by_name = read_record(named, time_column="t", signal_column="x", **stated, name="mine")
    by_index = read_record(
        save(tmp_path, ROWS, None, name="bare.txt"), time_column=0, signal_column="1", **stated
    )
    by_rate = read_record(named, signal_column="x", sampling_rate=RATE, **stated)
    for record in (by_name, by_index, by_rate):
        assert_is_the_signal(record, quantity="angle", unit="rad", scale=np.pi / 180.0)
    assert by_name.attrs["name"] == "mine"


def test_a_column_of_times_is_no_signal_unless_they_are_given_otherwise(tmp_path) -> None:
    path = save(tmp_path, ROWS, "time_s,displacement_m")
    with pytest.raises(
        InputError, match="'time_s' is named as the signal and holds the times; name the column"
    ):
        read_record(path, signal_column="time_s", unit="m")
    as_signal = read_record(path, signal_column="time_s", unit="m", sampling_rate=RATE)
    np.testing.assert_allclose(as_signal.values, TIME)


def test_a_quantity_without_unit_is_not_taken_for_si(tmp_path) -> None:
    with pytest.raises(InputError, match="column 'x' does not say its unit; give unit, one of m, cm, mm"):
        read_record(save(tmp_path, ROWS, "time_s,x"), quantity="displacement")


@pytest.mark.parametrize("time", ["t", "time", "Time"])
def test_a_time_without_unit_is_in_seconds(tmp_path, time) -> None:
    assert_is_the_signal(read_record(save(tmp_path, ROWS, f"{time},displacement_m")))


@pytest.mark.parametrize(
    ("header", "stated", "unit", "scale"),
    [
        ("displacement_mV", {"scale": 2.0, "unit": "mm"}, "m", 2e-3),
        ("displacement_mm", {"scale": 1.02}, "m", 1.02e-3),
        ("displacement_V", {"scale": 50.0, "unit": "mV/mm"}, "m", 20e-3),
        ("Displacement (counts)", {"scale": -400.0, "unit": "counts/mm"}, "m", -2.5e-6),
        ("y", {"quantity": "acceleration", "scale": 100.0, "unit": "mV/g"}, "m/s2", STANDARD_GRAVITY / 100.0),
        ("y", {"quantity": "acceleration", "scale": 0.5, "unit": "V/(m/s²)"}, "m/s2", 2.0),
    ],
)
def test_a_scale_with_its_unit(tmp_path, header, stated, unit, scale) -> None:
    record = read_record(save(tmp_path, ROWS, f"time_s,{header}"), **{"signal_column": 1, **stated})
    assert_is_the_signal(record, quantity=record.attrs["quantity"], unit=unit, scale=scale)


def test_a_sampling_rate_takes_the_place_of_a_bad_clock(tmp_path) -> None:
    rows = [f"{round(t, 1)!r},{x!r}" for t, x in zip(TIME.tolist(), SIGNAL.tolist(), strict=True)]
    path = save(tmp_path, rows)
    with pytest.raises(InputError, match="time is doubled at row 3"):
        read_record(path)
    assert_is_the_signal(read_record(path, sampling_rate=RATE))


def test_a_header_line_that_comes_again_begins_another_recording(tmp_path) -> None:
    header = "time_s,displacement_m"
    path = save(tmp_path, [*(f"{row}1" for row in ROWS), header, *ROWS], header)
    with pytest.raises(
        InputError, match=rf"row {N + 2}: the header line comes again.*; split .* skip_rows={N + 1}$"
    ):
        read_record(path)
    assert_is_the_signal(read_record(path, skip_rows=N + 1))
    numbers = save(tmp_path, ["0,1", *ROWS[1:]], None)
    assert read_record(numbers, time_column=0, signal_column=1, quantity="displacement", unit="m").size == N


def test_a_last_row_that_is_cut_off(tmp_path) -> None:
    with pytest.raises(
        InputError, match=rf"row {N + 1}: found 1 of 2 cells in the last row.*; remove that row$"
    ):
        read_record(save(tmp_path, [*ROWS[:-1], "1.1"]))


def edited(**changes):
    """Rows with some replaced; row numbers as an editor shows them, the header being row 1."""
    rows = list(ROWS)
    for key, text in changes.items():
        rows[int(key[3:]) - 2] = text
    return rows


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (edited(row17="0.15,abc"), "decay.csv: row 17: column displacement_m: 'abc' is not a number"),
        (edited(row17="0.15,"), "row 17: column displacement_m: the cell is empty"),
        (edited(row17="0.15,", row20="0.18,"), "the cell is empty, one of 2 without a number"),
        (edited(row17="0.15"), "row 17: found 1 of 2 cells"),
        (edited(row17="0.15,0.001,3"), "row 17: found 3 cells where the first line has 2"),
        (edited(row17="0.15,nan"), r"decay.csv: signal is nan at row 17 \(t = 0.15 s\)"),
        (edited(row17="0.15,-inf"), r"signal is -inf at row 17 \(t = 0.15 s\)"),
        (edited(row17="0.12,0.001"), r"runs backwards from 0.14 s at row 17 \(t = 0.12 s\)"),
        (edited(row17="0.15,nan"), "remove those rows, the times need not be even"),
        (edited(row17="0.14,0.001"), r"time is doubled at row 17 \(t = 0.14 s\)"),
        ([f"{t},2.5" for t in TIME], "constant at 2.5 m"),
        (ROWS[:4], "4 samples"),
        ([], "the file ends after its header line"),
    ],
)
def test_bad_rows_are_refused_and_named(tmp_path, rows, message) -> None:
    with pytest.raises(InputError, match=message):
        read_record(save(tmp_path, rows))


def test_times_in_ms_are_reported_in_ms(tmp_path) -> None:
    rows = [f"{1000 * float(t):g},{x}" for t, x in (row.split(",") for row in ROWS)]
    rows[15] = rows[12]
    with pytest.raises(InputError, match=r"runs backwards from 140 ms at row 17 \(t = 120 ms\)"):
        read_record(save(tmp_path, rows, "time_ms,displacement_m"))


def test_without_a_header_it_is_said_how_to_name_the_columns(tmp_path) -> None:
    path = save(tmp_path, ROWS, None)
    stated = r"no header line.* column 0, 1; .* time_column=0 signal_column=1 quantity=displacement"
    with pytest.raises(InputError, match=stated):
        read_record(path)
    read_record(path, time_column="0", signal_column="1", quantity="displacement", unit="m")


def test_settings_of_more_cells_than_the_table_are_passed_over(tmp_path) -> None:
    """As the logger of a rotary pendulum writes them: names and numbers of the settings, then one column."""
    column = [row.split(",")[1] for row in ROWS]
    path = save(tmp_path, ["90, 100, 5", *column], "trigger_deg, sample_rate, duration_sec")
    with pytest.raises(InputError, match=r"no header line.* sampling_rate=HZ quantity=displacement unit=m"):
        read_record(path)
    record = read_record(path, sampling_rate=RATE, quantity="displacement", unit="m")
    assert record.size == len(ROWS)


@pytest.mark.parametrize(
    ("header", "options", "message"),
    [
        ("x,displacement_m", {}, "no time column among x, displacement_m; name it time_s"),
        ("time_parsec,displacement_m", {}, "no time column"),
        ("time_s,x", {}, "no column says what was measured among time_s, x"),
        ("time_s,displacement", {}, "column 'displacement' does not say its unit"),
        ("time_s,displacement_rad", {}, "column displacement_rad: 'rad' does not measure displacement"),
        (
            "time_s,x",
            {"quantity": "displacement", "unit": "kg"},
            "in kg, which does not measure displacement",
        ),
        ("time_s,x", {"quantity": "speed"}, "quantity: unknown quantity 'speed'; give one of displacement"),
        ("time_s,displacement_m", {"quantity": "angle"}, "holds displacement, quantity says angle"),
        ("time_s,displacement_m", {"unit": "mm"}, "is in m, unit says mm"),
        ("time_s,displacement_V", {"unit": "mm"}, "is in V, unit says mm; give scale too"),
        ("time_s,displacement_m", {"unit": "mV/mm", "scale": 2.0}, "is in m, unit says mV/mm"),
        ("time_s,displacement_V", {"unit": "mV/mm"}, "mV/mm is a sensitivity; give its number with scale"),
        ("time_s,displacement_V", {"unit": "mV/deg", "scale": 2.0}, "mV/deg, which does not measure displ"),
        ("time_s,displacement_m", {"scale": 0.0}, "scale: is zero"),
        ("time_s,displacement_m", {"scale": float("nan")}, "scale"),
        (
            "time_s,displacement_m",
            {"signal_column": "y"},
            "signal_column='y' is not there; give one of time_s",
        ),
        ("time_s,displacement_m", {"time_column": "9"}, "time_column='9' is not there"),
        ("time_s,displacement_m", {"sampling_rate": -1.0}, "sampling_rate: -1 is not positive"),
        ("time_s,x", {"time_column": 0, "sampling_rate": 9.0}, "both time_column and sampling_rate"),
        ("time_s,time_s", {}, "several columns named 'time_s'"),
        ("time_s,time_ms", {}, "several time columns: time_s, time_ms"),
    ],
)
def test_unclear_columns_are_refused(tmp_path, header, options, message) -> None:
    with pytest.raises(InputError, match=message):
        read_record(save(tmp_path, ROWS, header), **options)


def test_what_is_asked_for_is_enough(tmp_path) -> None:
    path = save(tmp_path, ROWS, "time_s,encoder")
    with pytest.raises(InputError, match=r"or give signal_column, quantity and unit$"):
        read_record(path, unit="counts")
    with pytest.raises(InputError, match=r"angular_acceleration$"):
        read_record(path, signal_column="encoder", unit="counts")
    record = read_record(path, signal_column="encoder", quantity="angle", unit="counts")
    assert_is_the_signal(record, quantity="angle", unit="counts")


@pytest.mark.parametrize(
    ("header", "quantity", "unit"),
    [
        ("laser_mm", "displacement", "mm"),
        ("imu_pin_3_m_s2", "acceleration", "m/s2"),
        ("wheel_rad_s", "angular_velocity", "rad/s"),
        ("encoder_counts", "angle", "counts"),
    ],
)
def test_a_name_of_its_own_says_its_unit_at_the_end(tmp_path, header, quantity, unit) -> None:
    path = save(tmp_path, ROWS, f"time_s,{header}")
    assert read_record(path, quantity=quantity).attrs["read"] == f"{header} [{unit}] over time_s [s]"
    # an option has the word: the end of a name may be no unit
    assert (
        "[um]"
        in read_record(save(tmp_path, ROWS, "time_s,laser_m"), quantity="displacement", unit="um").attrs[
            "read"
        ]
    )
    with pytest.raises(InputError, match="column 'wire_in' does not say its unit"):
        read_record(save(tmp_path, ROWS, "time_s,wire_in"), quantity="displacement")


def test_several_signals_need_a_choice(tmp_path) -> None:
    path = save(tmp_path, [f"{row},0.5" for row in ROWS], "time_s,displacement_m,velocity_m_s")
    with pytest.raises(
        InputError, match=r"several signals: displacement_m \[sd 0\.00511 m\], velocity_m_s \[sd 0 m/s\];"
    ):
        read_record(path)
    assert_is_the_signal(read_record(path, quantity="displacement"))
    assert_is_the_signal(read_record(path, signal_column="displacement_m"))


def test_a_named_column_that_moves_less_than_another_of_its_quantity(tmp_path) -> None:
    def three_axes(names):
        axes = np.column_stack([TIME, SIGNAL / 30.0, SIGNAL + 0.004, 9.0 * SIGNAL]).tolist()
        return save(tmp_path, [",".join(map(repr, row)) for row in axes], names)

    path = three_axes("time_s,Acceleration x (m/s^2),Acceleration y (m/s^2),Temperature (K)")
    with pytest.warns(
        RecordWarning, match=r"column Acceleration y .* moves 30 times as much as Acceleration x"
    ):
        read_record(path, signal_column=1)
    read_record(path, signal_column=2)
    # in other units, and without any
    path = three_axes("time_s,x_cm,y_mm,angle_rad")
    with pytest.warns(RecordWarning, match="column y_mm moves 3 times as much as x_cm"):
        read_record(path, signal_column="x_cm")
    path = three_axes("time_s,ax,ay,angle")
    with pytest.warns(RecordWarning, match="column ay moves 30 times"):
        read_record(path, signal_column="ax", quantity="acceleration", unit="g")


def test_two_sensors_of_one_motion_need_no_warning(tmp_path) -> None:
    rows = [f"{row},{1.03 * x!r}" for row, x in zip(ROWS, SIGNAL.tolist(), strict=True)]
    read_record(save(tmp_path, rows, "time_s,x_mm,y_mm"), signal_column="x_mm")


def test_the_length_of_a_vector_is_no_signal(tmp_path) -> None:
    lengths = np.hypot(SIGNAL + 4.0, 9.0).tolist()
    rows = [f"{row},{length!r}" for row, length in zip(ROWS, lengths, strict=True)]
    path = save(tmp_path, rows, "Time (s),Acceleration x (m/s^2),Absolute acceleration (m/s^2)")
    message = (
        r"Absolute acceleration .* without the sign of the motion; with signal_column name the axis that "
    )
    with pytest.raises(
        InputError, match=message + r"moves most: Acceleration x \(m/s\^2\) \[sd 0.00511 m/s2"
    ):
        read_record(path, signal_column=2)
    assert read_record(path).attrs["read"].startswith("Acceleration x (m/s^2)")
    alone = save(tmp_path, [f"{t!r},{r!r}" for t, r in zip(TIME.tolist(), lengths, strict=True)], "time,TgF")
    with pytest.raises(
        InputError, match=r"column TgF is the length of a vector.*; record the axis of the motion"
    ):
        read_record(alone)
    # what has a sign is none, whatever its name, nor is the position that an absolute encoder shows
    assert_is_the_signal(
        read_record(save(tmp_path, ROWS, "time_s,total velocity (m/s)")), quantity="velocity", unit="m/s"
    )
    rows = [f"{t!r},{r!r}" for t, r in zip(TIME.tolist(), lengths, strict=True)]
    read_record(save(tmp_path, rows, "time_s,absolute angle (rad)"))


def test_mixed_decimal_marks_are_refused(tmp_path) -> None:
    rows = [row.replace(",", ";") for row in ROWS]
    rows[30] = rows[30].replace(".", ",")
    with pytest.raises(InputError, match="mixes decimal points with decimal commas"):
        read_record(save(tmp_path, rows, "time_s;displacement_m"))


def test_uneven_times_are_kept(tmp_path) -> None:
    record = read_record(save(tmp_path, ROWS[:50] + ROWS[51:]))
    np.testing.assert_allclose(record["time"].values, np.delete(TIME, 50), atol=1e-9)
    np.testing.assert_allclose(record.values, np.delete(SIGNAL, 50), atol=1e-7)


CAPSTONE_NAMES = ("Time (s)", "Angle, Ch 1+2 (rad)", "Angular Velocity, Ch 1+2 (rad/s)", "Output Voltage (V)")
CAPSTONE_SAMPLES = {1: N, 2: N - 30}


def capstone_rows(runs=CAPSTONE_SAMPLES):
    """Cells of an export of runs side by side; the velocity, a difference, begins later and ends earlier."""
    table = [[f"{name} Run #{run}" for run in runs for name in CAPSTONE_NAMES]]
    for k in range(N):
        cells = []
        for run, samples in runs.items():
            inside = 0 < k < samples - 2
            cells += [
                f"{TIME[k]:.3f}" if k < samples else "",
                f"{run * SIGNAL[k]:.7f}" if k < samples - 1 else "",
                f"{run * SIGNAL[k] + 1.0:.7f}" if inside else "",
                "-0.006" if k < samples else "",
            ]
        table.append(cells)
    return table


def save_capstone(folder, table, *, separator=";"):
    """Write it as Capstone does: byte-order mark, quoted names, decimal commas next to semicolons."""
    lines = [separator.join(f'"{name}"' for name in table[0])]
    lines += [separator.join(cells) for cells in table[1:]]
    if separator != ",":
        lines[1:] = [line.replace(".", ",") for line in lines[1:]]
    return save(folder, lines, None, encoding="utf-8-sig", newline="\r\n", name="capstone.csv")


@pytest.mark.parametrize("separator", [";", "\t", ","])
@pytest.mark.parametrize("run", [1, 2])
def test_a_run_of_several(tmp_path, separator, run) -> None:
    path = save_capstone(tmp_path, capstone_rows(), separator=separator)
    samples = CAPSTONE_SAMPLES[run] - 1
    by_name, by_number = {"signal_column": "Angle, Ch 1+2 (rad)"}, {"time_column": 0, "signal_column": 1}
    for stated in ({"quantity": "angle"}, by_name, by_number):
        record = read_record(path, run=run, **stated)
        assert (record.attrs["quantity"], record.attrs["units"]) == ("angle", "rad")
        np.testing.assert_allclose(record["time"].values, TIME[:samples], atol=1e-12)
        np.testing.assert_allclose(record.values, run * SIGNAL[:samples], atol=1e-7)


def test_a_column_that_begins_later_keeps_its_times(tmp_path) -> None:
    path = save_capstone(tmp_path, capstone_rows())
    record = read_record(path, run=2, quantity="angular_velocity")
    assert record.attrs["units"] == "rad/s"
    np.testing.assert_allclose(record["time"].values, TIME[1 : N - 32], atol=1e-12)
    np.testing.assert_allclose(record.values, 2.0 * SIGNAL[1 : N - 32] + 1.0, atol=1e-7)


def test_a_single_run_need_not_be_named(tmp_path) -> None:
    path = save_capstone(tmp_path, capstone_rows({7: N}))
    record = read_record(path, quantity="angle")
    np.testing.assert_array_equal(record.values, read_record(path, quantity="angle", run=7).values)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "capstone.csv: holds 2 runs; choose one with run: 1, 2"),
        ({"run": 3}, "there is no run 3; choose one with run: 1, 2"),
        (
            {"run": 2},
            r"several signals: Angle, Ch 1\+2 \(rad\) \[.*\], Angular Velocity, Ch 1\+2 \(rad/s\) \[sd",
        ),
        (
            {"run": 2, "signal_column": "Angle"},
            r"'Angle' is not there; give one of Time \(s\), Angle, Ch 1\+2 \(rad\), Angular",
        ),
        ({"run": 1, "signal_column": 1, "unit": "deg"}, "is in rad, unit says deg"),
        (
            {"run": 1, "signal_column": 3},
            r"does not say what was measured; give quantity, one of disp.*cceleration$",
        ),
        ({"run": 1, "time_column": 3, "signal_column": 1}, r"time column Output Voltage \(V\) is in V"),
    ],
)
def test_an_unclear_run_is_refused(tmp_path, options, message) -> None:
    with pytest.raises(InputError, match=message):
        read_record(save_capstone(tmp_path, capstone_rows()), **options)


def test_a_run_of_a_file_without_runs_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"decay.csv: no column belongs to a run; leave out run"):
        read_record(save(tmp_path, ROWS), run=1)


@pytest.mark.parametrize(
    ("blanks", "message"),
    [
        ([(40, 5)], r"row 41: column Angle, Ch 1\+2 \(rad\) Run #2: the cell is empty"),
        ([(40, 4)], r"row 41: column Time \(s\) Run #2: the cell is empty"),
        ([(1, 4)], r"row 2: column Time \(s\): the cell is empty next to a sample"),
        ([(N - 31, 4), (N - 30, 4)], r"row 90: column Time \(s\): the cell is empty next to a sample"),
    ],
)
def test_a_blank_inside_a_run_is_refused(tmp_path, blanks, message) -> None:
    table = capstone_rows()
    for row, column in blanks:
        table[row][column] = ""
    with pytest.raises(InputError, match=message):
        read_record(save_capstone(tmp_path, table), run=2, signal_column=1)


@pytest.mark.parametrize("header", ["Time (s),Position (mm)", "t / s,x / mm", "Time [s],Displacement [mm]"])
def test_headers_as_people_write_them(tmp_path, header) -> None:
    assert_is_the_signal(read_record(save(tmp_path, ROWS, header)), scale=1e-3)


@pytest.mark.parametrize("clock", ["Zeit [s]", "temps (s)"])
def test_seconds_are_times_in_any_language(tmp_path, clock) -> None:
    assert_is_the_signal(read_record(save(tmp_path, ROWS, f"{clock},Weg [m]")))
    rows = [f"{row},1" for row in ROWS]
    with pytest.raises(InputError, match="no time column among"):
        read_record(save(tmp_path, rows, f"{clock},Weg [m],Dauer [s]"))
    with pytest.raises(InputError, match="no time column among"):
        read_record(save(tmp_path, ROWS, "Zeit [min],Weg [m]"))


def test_a_bracket_that_is_no_unit_leaves_the_word_to_the_option(tmp_path) -> None:
    path = save(tmp_path, ROWS, "Time (s),Angle (encoder 1)")
    stated = {"signal_column": 1, "quantity": "angle"}
    assert_is_the_signal(
        read_record(path, **stated, unit="deg"), quantity="angle", unit="rad", scale=np.pi / 180.0
    )
    with pytest.raises(InputError, match="is in encoder 1, which does not measure angle; give unit"):
        read_record(path, **stated)


def test_a_name_may_end_in_a_prime(tmp_path) -> None:
    rows = [f"{row},'0.5',2" for row in ROWS]
    path = save(tmp_path, rows, "X,Y,X',Y'")
    assert_is_the_signal(
        read_record(path, time_column="X", signal_column="Y", quantity="displacement", unit="m")
    )
    with pytest.raises(InputError, match="give one of X, Y, X', Y'"):
        read_record(path, signal_column="Z")


def test_paths_that_hold_no_record(tmp_path) -> None:
    empty, unknown, binary = tmp_path / "empty.csv", tmp_path / "decay.doc", tmp_path / "decay.csv"
    empty.touch()
    unknown.touch()
    binary.write_bytes(b"\x00\x01" * 50)
    for path, message in (
        (tmp_path / "none.csv", "there is no such file"),
        (tmp_path, "this is a folder"),
        (empty, "the file is empty"),
        (unknown, "unknown suffix '.doc'; give a file of one of .csv, .txt"),
        (binary, "this is not a text file"),
    ):
        with pytest.raises(InputError, match=message):
            read_record(path)


@pytest.mark.parametrize("suffix", sorted(set(READERS) - {*TEXT_SUFFIXES, ".zarr"}))
def test_a_file_of_another_format_is_one_clear_error(tmp_path, suffix) -> None:
    path = tmp_path / f"decay{suffix}"
    path.write_text("rubbish " * 40)
    with pytest.raises(InputError, match=r"this is not an? .* file|holds no vector of numbers"):
        read_record(path)


def test_mat_vectors_cells_and_structs(tmp_path) -> None:
    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.stack([SIGNAL, -SIGNAL]), SIGNAL[:, None]
    path = tmp_path / "decay.mat"
    content = {"time_s": TIME, "displacement_mm": 1e3 * SIGNAL, "Y": cells, "note": "text"}
    savemat(path, {**content, "log": {"time": TIME[:, None], "signals": {"values": SIGNAL}}})
    assert_is_the_signal(read_record(path), rtol=1e-12)
    stated = {"quantity": "displacement", "unit": "m"}
    for column in ("Y[0][0]", "Y[1]", "log.signals.values"):
        assert_is_the_signal(read_record(path, time_column="log.time", signal_column=column, **stated))
    with pytest.raises(InputError, match=r"give one of .*Y\[0\]\[0\], Y\[0\]\[1\], Y\[1\], log.time"):
        read_record(path, signal_column="Z", **stated)


def test_a_reader_registered_from_outside_is_found_by_its_suffix(tmp_path, monkeypatch) -> None:
    def read_columns(path: Path) -> Table:
        content = json.loads(path.read_text(encoding="utf-8"))
        clock = partial(np.asarray, content["ms"])
        signal = Column(partial(np.asarray, content["mm"]), unit="mm", attrs={"synthetic": True})
        return Table({"time": Column(clock, unit="ms"), "displacement": signal})

    path = tmp_path / "decay.JSON"
    path.write_text(
        json.dumps({"ms": (1e3 * TIME).tolist(), "mm": (1e3 * SIGNAL).tolist()}), encoding="utf-8"
    )
    with pytest.raises(InputError, match="unknown suffix"):
        read_record(path)
    monkeypatch.setitem(READERS, ".json", read_columns)
    record = read_record(path)
    assert_is_the_signal(record)
    assert record.attrs["synthetic"] is True
    path.write_text(json.dumps({"ms": [0.0], "mm": [1.0]}), encoding="utf-8")
    with pytest.raises(InputError, match=r"decay\.JSON: 1 samples"):
        read_record(path)


@pytest.mark.parametrize("suffix", [".h5", ".mat"])
def test_hdf5_data_sets_by_path(tmp_path, suffix) -> None:
    import h5py

    path = tmp_path / f"decay{suffix}"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["run/time_s"] = TIME
        file["run/displacement_m"] = SIGNAL[:, None]
        file["run/image"] = np.zeros((4, 4))
    if suffix == ".mat":
        # a MAT file of version 7.3 is HDF5 behind this header
        header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
        with path.open("r+b") as file:
            file.write(header)
    assert_is_the_signal(read_record(path))


def test_damage_within_the_data_of_hdf5_is_said(tmp_path) -> None:
    import h5py

    path = tmp_path / "decay.h5"
    with h5py.File(path, "w") as file:
        file["time_s"] = TIME
        packed = file.create_dataset("displacement_m", data=SIGNAL, chunks=(50,), compression="gzip")
        chunk = packed.id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset : chunk.byte_offset + chunk.size] = bytes(chunk.size)
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"this is not an HDF5 file \(Can't synchronously read data"):
        read_record(path)


@pytest.mark.parametrize("suffix", [".csv", ".nc"])
def test_saved_records_come_back(tmp_path, suffix) -> None:
    record = make_record(TIME, SIGNAL, "angular_velocity", unit="V", name="mine", synthetic=True, seed=5)
    back = read_record(write_record(record, tmp_path / f"saved{suffix}"))
    np.testing.assert_array_equal(back.values, record.values)
    np.testing.assert_array_equal(back["time"].values, record["time"].values)
    assert back.attrs["synthetic"] is True
    assert (back.attrs["quantity"], back.attrs["units"]) == ("angular_velocity", "V")
    if suffix == ".nc":
        assert back.attrs == {**record.attrs, "read": "angular_velocity [V] over time [s]"}
    else:
        assert (tmp_path / "saved.csv").read_text().startswith("# synthetic")


def test_a_synthetic_csv_edited_by_hand_stays_synthetic(tmp_path) -> None:
    path = save(tmp_path, ["# synthetic", "time_s,displacement_m", *ROWS], None)
    assert read_record(path).attrs["synthetic"] is True
    assert "synthetic" not in read_record(save(tmp_path, ROWS)).attrs


@pytest.mark.parametrize("engine", ["h5netcdf", "scipy"])
def test_netcdf_of_others(tmp_path, engine) -> None:
    path = tmp_path / "decay.nc"
    variables = {"x": ("time", 1e3 * SIGNAL, {"units": "mm"}), "other": ("time", SIGNAL)}
    xr.Dataset(variables, coords={"time": TIME}).to_netcdf(path, engine=engine)
    assert_is_the_signal(read_record(path, signal_column="x", quantity="displacement"), rtol=1e-12)


def test_zarr_records_and_fleets(tmp_path) -> None:
    record = make_record(TIME, SIGNAL, "displacement", name="mine", seed=2)
    record.to_dataset(name="displacement").to_zarr(tmp_path / "one.zarr", consolidated=False)
    assert_is_the_signal(read_record(tmp_path / "one.zarr"))
    fleet = record.expand_dims(record=3).to_dataset(name="displacement")
    fleet.to_zarr(tmp_path / "fleet.zarr", consolidated=False)
    with pytest.raises(InputError, match="displacement holds many records"):
        read_record(tmp_path / "fleet.zarr")


def test_writing_refuses_other_suffixes_and_leaves_nothing(tmp_path) -> None:
    record = make_record(TIME, SIGNAL, "displacement")
    with pytest.raises(InputError, match=r"cannot write a record as '.xls'"):
        write_record(record, tmp_path / "a.xls")
    with pytest.raises(InputError, match="cannot be written"):
        write_record(record, tmp_path / "no" / "a.csv")
    with pytest.raises(InputError, match="nan"):
        write_record(record.where(record["time"] != TIME[5]), tmp_path / "a.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_wav_without_a_rate_is_refused(tmp_path) -> None:
    path = tmp_path / "counts.wav"
    wavfile.write(path, RATE, SIGNAL.astype(np.float32))
    content = bytearray(path.read_bytes())
    # behind "RIFF", size, "WAVE", "fmt ", size, format and channels
    content[24:28] = bytes(4)
    path.write_bytes(content)
    with pytest.raises(InputError, match="says that it has 0 samples a second"):
        read_record(path, quantity="displacement", unit="m")


def test_wav_needs_a_quantity_and_unit(tmp_path) -> None:
    wavfile.write(tmp_path / "float.wav", RATE, SIGNAL)
    wavfile.write(
        tmp_path / "counts.wav", RATE, np.stack([SIGNAL * 1e5, -SIGNAL * 1e5], axis=1).astype(np.int16)
    )
    with pytest.raises(InputError, match="no column says what was measured"):
        read_record(tmp_path / "float.wav")
    assert_is_the_signal(
        read_record(tmp_path / "float.wav", quantity="velocity", unit="m/s"), quantity="velocity", unit="m/s"
    )
    counts = read_record(tmp_path / "counts.wav", quantity="velocity", signal_column=1)
    assert counts.attrs["units"] == "counts"
    np.testing.assert_array_equal(counts.values, (-SIGNAL * 1e5).astype(np.int16))
    with pytest.raises(InputError, match="is in counts, unit says m/s"):
        read_record(tmp_path / "counts.wav", quantity="velocity", signal_column=1, unit="m/s")


def test_tdms(tmp_path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    timing = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0, "wf_samples": 1}
    signal = ChannelObject("rig", "sensor", 1e3 * SIGNAL, properties={**timing, "unit_string": "mm"})
    with TdmsWriter(tmp_path / "decay.tdms") as writer:
        writer.write_segment([signal, ChannelObject("rig", "label", ["a", "b"])])
    record = read_record(tmp_path / "decay.tdms", quantity="displacement", signal_column="rig/sensor")
    assert_is_the_signal(record, rtol=1e-12)


def test_uff(tmp_path) -> None:
    import pyuff

    fields = inspect.signature(pyuff.prepare_58).parameters.keys() - {"return_full_dict"}
    texts = ("ent_name", "lab", "id1", "id2", "id3", "id4", "id5")
    content = {field: "none" if field.endswith(texts) else 0 for field in fields}
    content |= {"type": 58, "func_type": 1, "ord_data_type": 4, "num_pts": N, "data": 1e3 * SIGNAL, "x": TIME}
    content |= {"abscissa_spacing": 1, "abscissa_inc": 1.0 / RATE, "abscissa_spec_data_type": 17}
    content |= {"ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "mm"}
    pyuff.UFF(str(tmp_path / "decay.uff")).write_sets(content, "overwrite")
    record = read_record(tmp_path / "decay.uff")
    assert_is_the_signal(record, rtol=1e-9)


def test_mf4(tmp_path) -> None:
    import asammdf

    with asammdf.MDF() as file:
        file.append([asammdf.Signal(1e3 * SIGNAL, TIME, name="displacement", unit="mm")])
        file.save(tmp_path / "decay.mf4")
    assert_is_the_signal(read_record(tmp_path / "decay.mf4"), rtol=1e-12)
    content = bytearray((tmp_path / "decay.mf4").read_bytes())
    (tmp_path / "decay.mf4").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"decay.mf4: this is not an MDF file \("):
        read_record(tmp_path / "decay.mf4")


def test_mf4_channels_of_one_name_are_counted(tmp_path) -> None:
    import asammdf

    with asammdf.MDF() as file:
        for times in (2.0, 1.0):
            file.append([asammdf.Signal(times * 1e3 * SIGNAL, TIME, name="displacement", unit="mm")])
        file.save(tmp_path / "decay.mf4")
    with pytest.raises(InputError, match=r"several signals: 0/displacement \[.*, 1/displacement"):
        read_record(tmp_path / "decay.mf4")
    with pytest.warns(RecordWarning, match="0/displacement moves 2 times"):
        record = read_record(tmp_path / "decay.mf4", signal_column="1/displacement")
    assert_is_the_signal(record, rtol=1e-12)


@pytest.mark.parametrize("suffix", [".tdms", ".uff", ".mf4", ".zarr"])
def test_a_missing_package_says_how_to_get_it(tmp_path, monkeypatch, suffix) -> None:
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(optional, "import_module", missing)
    path = tmp_path / f"decay{suffix}"
    path.mkdir() if suffix == ".zarr" else path.write_text("x")
    with pytest.raises(InputError, match=r'pip install "\.\[formats\]"'):
        read_record(path)


@pytest.mark.parametrize("between", [" ", ",", "\t"])
def test_names_on_a_comment_above_the_numbers_are_taken(between: str, tmp_path: Path) -> None:
    """As numpy.savetxt writes its header."""
    path, rows = tmp_path / "decay.txt", [row.replace(",", " ") for row in ROWS]
    path.write_text("\n".join(["# of the morning", f"# time_s{between}displacement_m", *rows]))
    assert_is_the_signal(read_record(path))
    path.write_text("\n".join(["# of two runs", *rows]))
    with pytest.raises(InputError, match="no header line"):
        read_record(path)


@pytest.mark.parametrize(
    ("header", "per_second"),
    [("time (days)", 1.0 / 86400.0), ("t [d]", 1.0 / 86400.0), ("time_d", 1.0 / 86400.0)],
)
def test_times_in_days(tmp_path, header, per_second) -> None:
    rows = [f"{738000.5 + per_second * t:.12f},{x!r}" for t, x in zip(TIME, SIGNAL.tolist(), strict=True)]
    record = read_record(save(tmp_path, rows, f"{header},displacement_m"))
    assert np.diff(record["time"].values) == pytest.approx(1.0 / RATE, rel=0.01)


@pytest.mark.parametrize(("unit", "in_seconds"), [("d", 86400.0), ("min", 60.0)])
def test_times_in_another_unit_that_no_one_states_are_refused(tmp_path, unit, in_seconds) -> None:
    rows = [f"{t:.15g},{x!r}" for t, x in zip(TIME / in_seconds, SIGNAL.tolist(), strict=True)]
    record = read_record(save(tmp_path, rows, "time,displacement_m"))
    with pytest.raises(InputError, match=rf"time in {unit}\?; name the time column time_{unit} "):
        check_time_unit(record, 10.0)


def test_hdf5_with_units_by_their_singular(tmp_path) -> None:
    import h5py

    with h5py.File(tmp_path / "decay.h5", "w") as file:
        for name, values, unit in (("time", TIME / 60.0, "minutes"), ("displacement", 1e3 * SIGNAL, "mm")):
            file[name] = values
            file[name].attrs["unit"] = unit
    assert_is_the_signal(read_record(tmp_path / "decay.h5"), rtol=1e-12)


def test_tdms_with_a_channel_of_time_stamps(tmp_path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    stamps = np.datetime64("2024-03-01T12:00:00") + np.rint(1e9 * TIME).astype("timedelta64[ns]")
    with TdmsWriter(tmp_path / "decay.tdms") as writer:
        channels = [("stamps", stamps), ("displacement_m", SIGNAL)]
        writer.write_segment([ChannelObject("rig", name, values) for name, values in channels])
    record = read_record(tmp_path / "decay.tdms")
    assert_is_the_signal(record, rtol=1e-9)
    assert "[s since 2024-03-01T12:00:00" in record.attrs["read"]


def test_netcdf_with_times_since_a_date(tmp_path) -> None:
    dataset = xr.Dataset(
        {"displacement": ("time", SIGNAL, {"units": "m"})},
        coords={"time": ("time", 1e3 * TIME, {"units": "milliseconds since 2024-01-01 12:00:00"})},
    )
    dataset.to_netcdf(tmp_path / "decay.nc", engine="scipy")
    assert_is_the_signal(read_record(tmp_path / "decay.nc"), rtol=1e-12)


def test_a_fleet_whose_times_are_in_another_unit(tmp_path) -> None:
    records = xr.DataArray(
        np.tile(SIGNAL, (2, 2, 1)),
        dims=("machine", "point", "time"),
        coords={"time": ("time", 1e3 * TIME, {"units": "ms"})},
        attrs={"units": "m"},
    )
    records.to_dataset(name="displacement").to_zarr(tmp_path / "fleet.zarr", consolidated=False)
    fleet = open_fleet(tmp_path / "fleet.zarr")
    assert fleet is not None
    assert fleet["time"].values == pytest.approx(TIME, rel=1e-12)
    assert fleet["time"].attrs["units"] == "s"
    with pytest.raises(InputError, match="time in unit 'ms' instead of s"):
        as_stack(records, None, "displacement")
    with pytest.raises(InputError, match="time in unit 'ms' instead of s"):
        validate_record(records[0, 0].assign_attrs(quantity="displacement"))


@pytest.mark.parametrize(("unit", "a_second", "bits"), [("us", 1e6, 32), ("ms", 1e3, 32), ("ms", 1e3, 16)])
def test_a_counter_of_ticks_that_starts_over(tmp_path, unit, a_second, bits) -> None:
    """As millis() and micros() of a microcontroller do."""
    ticks = (np.rint(a_second * TIME).astype(np.int64) + 2**bits - 100) % 2**bits
    rows = [f"{tick},{x!r}" for tick, x in zip(ticks.tolist(), SIGNAL.tolist(), strict=True)]
    record = read_record(save(tmp_path, rows, f"time_{unit},displacement_m"))
    assert np.diff(record["time"].values) == pytest.approx(1.0 / RATE, rel=1e-3)
