"""Column names as programs and people write them: what is read for certain, and what is not."""

from __future__ import annotations

import pytest

from friction_bayes.records.readers.headers import is_magnitude, read_header, split_run


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("displacement_mm", "displacement", "mm"),
        ("run/angular_velocity_deg_s", "angular_velocity", "deg/s"),
        ("Angle (deg)", "angle", "deg"),
        ("Angle [°]", "angle", "deg"),
        ("Angle, Ch 1+2 (rad)", "angle", "rad"),
        ("Angular Acceleration, Ch 3+4 (rad/s²)", "angular_acceleration", "rad/s2"),
        ("Angular velocity / (rad/s)", "angular_velocity", "rad/s"),
        ("Position (mm)", "displacement", "mm"),
        ("rig/Velocity (m/s)", "velocity", "m/s"),
        ("x / mm", "displacement", "mm"),
        ("x/mm", "displacement", "mm"),
        ("v/m/s", "velocity", "m/s"),
        ("rig/displacement_m", "displacement", "m"),
        ("a_x / g", "acceleration", "g"),
        ("Acceleration y (g)", "acceleration", "g"),
        ("Acceleration (m/s^2)", "acceleration", "m/s2"),
        ("Acceleration (ms⁻²)", "acceleration", "m/s2"),
        ("Linear Acceleration x (m/s^2)", "acceleration", "m/s2"),
        ("ax (m/(s²))", "acceleration", "m/s2"),
        ("gFx", "acceleration", "g"),
        ("Gyroscope x (rad/s)", "angular_velocity", "rad/s"),
        ("gyro_z (dps)", "angular_velocity", "deg/s"),
        ("disp_mm", "displacement", "mm"),
        ("pos_x_um", "displacement", "um"),
        ("Untitled/theta_deg", "angle", "deg"),
        ("acc_g", "acceleration", "g"),
        ("Deflection (Inches)", "displacement", "in"),
        ("Position (nm)", "displacement", "nm"),
        ("POSITION (MM)", "displacement", "mm"),
        ("Angle (left) (deg)", "angle", "deg"),
        ("Angle (V)", "angle", "V"),
        ("Displacement (a.u.)", "displacement", "a.u."),
        ("Position (px)", "displacement", "px"),
        ("x (pixels)", "displacement", "px"),
    ],
)
def test_quantity_and_unit(name: str, quantity: str, unit: str) -> None:
    header = read_header(name)
    assert not header.is_time
    assert header.quantity is not None
    assert (header.quantity.name, header.unit) == (quantity, unit)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Output Voltage (V)", "V"),
        ("Mass (g)", "g"),
        ("theta_m", None),
        ("displacement_in", None),
        ("Position (furlong)", "furlong"),
        ("Velocity (rad/s)", "rad/s"),
        ("Temperature (°C)", "degC"),
        ("Angle (encoder 1)", "encoder 1"),
        ("force_N", None),
        ("X'", None),
        ("Y[0][1]", None),
    ],
)
def test_a_quantity_that_is_not_certain_is_not_read(name: str, unit: str | None) -> None:
    assert read_header(name) == (False, None, unit)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time", None),
        ("t", None),
        ("Elapsed Time", None),
        ("time_ms", "ms"),
        ("t_us", "us"),
        ("Time (msec)", "ms"),
        ("Time_s", "s"),
        ("Time (s)", "s"),
        ("Time (sec)", "s"),
        ("t / ms", "ms"),
        ("t/s", "s"),
        ("rig/time", None),
        ("t [min]", "min"),
        ("millis", "ms"),
        ("micros()", "us"),
        ("time_millis", "ms"),
        ("Seconds", "s"),
    ],
)
def test_time(name: str, unit: str | None) -> None:
    assert read_header(name) == (True, None, unit)


@pytest.mark.parametrize("name", ["time_of_day", "timer (s)", "tau", "time[0]"])
def test_what_is_no_time(name: str) -> None:
    assert not read_header(name).is_time


def test_runs() -> None:
    assert split_run("Angle, Ch 1+2 (rad) Run #12") == ("Angle, Ch 1+2 (rad)", 12)
    assert split_run("Angle (rad)") == ("Angle (rad)", None)
    assert split_run("Run #1") == ("Run #1", None)


@pytest.mark.parametrize(
    ("name", "magnitude"),
    [
        ("Absolute acceleration (m/s^2)", True),
        ("Absolute (rad/s)", True),
        ("TgF", True),
        ("|a| (m/s2)", True),
        ("a_abs", True),
        ("acceleration_total_g", True),
        ("Acceleration x (m/s^2)", False),
        ("gFx", False),
        ("normal_acc_g", False),
    ],
)
def test_lengths_of_vectors(name: str, magnitude: bool) -> None:
    assert is_magnitude(name) is magnitude
