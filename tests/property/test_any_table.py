"""Whatever a text file contains, reading it ends in a record or in an error that says what is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers import read_record

NUMBERS = st.one_of(
    st.floats().map(repr),
    st.floats(-10.0, 10.0).map(lambda value: f"{value:.3f}".replace(".", ",")),
    st.integers(-(10**30), 10**30).map(str),
)
NAMES = st.sampled_from(
    [
        "time_s",
        "t",
        "Time (ms)",
        "displacement_mm",
        "Angle (°)",
        "gFx",
        "x",
        "",
        "Run #1",
        "x (V) Run #2",
        "(s)",
    ]
)
CLOCK_TIMES = st.sampled_from(["23:59:59.9", "0:00:00 pm", "2024-02-30T01:02:03", "2024/3/1 1:02:03Z", "1:2"])
CELLS = st.one_of(NUMBERS, NUMBERS, NUMBERS, NAMES, CLOCK_TIMES, st.text(max_size=6))
GOOD = "time_s,displacement_m\n" + "\n".join(f"{k},{k * k}" for k in range(20))
# the even grid through these times would take a hundred gigabytes
TIMED = "time,displacement_m\n" + "\n".join(f"{k // 60 + 1}:{k % 60:02}:30,{k * k}" for k in range(20))
BURSTS = "time_s,displacement_m\n" + "\n".join(f"{k // 3 + 1e-9 * (k % 3)!r},{k * k}" for k in range(30))
OPTIONS = st.fixed_dictionaries(
    {},
    optional={
        "quantity": st.sampled_from(["displacement", "angle", "acceleration"]),
        "unit": st.sampled_from(["m", "mm", "deg", "mV/g", "counts"]),
        "scale": st.sampled_from([2.0, 0.0, -1e300, float("nan")]),
        "time_column": st.integers(0, 3),
        "signal_column": st.integers(0, 3),
        "sampling_rate": st.sampled_from([100.0, 1e-300, 0.0]),
        "run": st.integers(0, 2),
        "skip_rows": st.integers(0, 3),
        "start": st.sampled_from([0.0, 2.0, float("inf")]),
        "end": st.sampled_from([1.0, 5.0]),
    },
)


@st.composite
def tables(draw: st.DrawFn) -> str:
    """Lines above, a header and rows that rise in time, with a few cells of any kind among them."""
    separator, width = draw(st.sampled_from([",", ";", "\t", " "])), draw(st.integers(1, 4))
    rows = draw(st.integers(0, 30))
    table = [
        [f"{0.1 * k:.3g}", *(f"{np.cos(0.7 * k + j):.4g}" for j in range(width - 1))] for k in range(rows)
    ]
    for _ in range(draw(st.integers(0, 3)) if rows else 0):
        table[draw(st.integers(0, rows - 1))][draw(st.integers(0, width - 1))] = draw(CELLS)
    above = draw(st.lists(st.lists(CELLS, max_size=5), max_size=3))
    usual = st.just(["time_s", "displacement_mm", "x", "y"][:width])
    header = draw(st.one_of(usual, st.lists(NAMES, min_size=width, max_size=width, unique=True)))
    return "\n".join(separator.join(row) for row in [*above, header, *table])


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(tables(), tables(), st.text(max_size=200)), options=st.one_of(st.just({}), OPTIONS))
@example(content=GOOD, options={})
@example(content=BURSTS, options={})
@example(content=TIMED, options={})
@example(content="time_s,displacement_m\n", options={"start": 1.0})
@example(content="time_s\n0\n0.1\n0.2\n0.3\n", options={"unit": "m", "signal_column": 0})
def test_reading_ends_in_a_record_or_an_input_error(tmp_path, content: str, options: dict) -> None:
    path = tmp_path / "record.csv"
    path.write_text(content, encoding="utf-8", newline="")
    try:
        record = read_record(path, **options)
    except InputError:
        return
    assert np.isfinite(record.values).all()
    assert (np.diff(record["time"].values) > 0.0).all()


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200))
@example(content=b"\xfe\xff\0\0\0")
@pytest.mark.parametrize("suffix", [".csv", ".mat", ".nc", ".h5", ".wav", ".tdms", ".uff", ".mf4"])
def test_bytes_are_no_record(tmp_path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"record{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError):
        read_record(path)
