"""What a CSV file says does not depend on how it is written down."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from friction_bayes.core.quantities import QUANTITIES, UNCALIBRATED_UNITS
from friction_bayes.records.readers import read_record
from friction_bayes.records.record import make_record
from friction_bayes.records.writers import write_record

SIGNALS = st.lists(st.floats(-1e12, 1e12, allow_nan=False), min_size=8, max_size=40, unique=True).filter(
    lambda values: np.ptp(values) > 1e-9 * np.abs(values).max()
)
SETTINGS = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


@SETTINGS
@given(
    values=SIGNALS,
    step=st.floats(1e-5, 1e3),
    start=st.integers(-1000, 1000),
    quantity=st.sampled_from(sorted(QUANTITIES)),
    unit=st.sampled_from([None, *UNCALIBRATED_UNITS]),
)
def test_a_written_record_reads_back_bit_for_bit(tmp_path, values, step, start, quantity, unit) -> None:
    time = (start + np.arange(len(values))) * step
    record = make_record(time, values, quantity, unit=unit)
    back = read_record(write_record(record, tmp_path / "record.csv"))
    assert back.values.tobytes() == record.values.tobytes()
    assert back["time"].values.tobytes() == record["time"].values.tobytes()
    assert (back.attrs["quantity"], back.attrs["units"]) == (quantity, record.attrs["units"])


@SETTINGS
@given(
    values=SIGNALS,
    separator=st.sampled_from([";", "\t", ","]),
    comma=st.booleans(),
    bom=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
    blank=st.integers(0, 3),
    comments=st.integers(0, 2),
    digits=st.integers(1, 17),
)
def test_the_way_of_writing_does_not_matter(
    tmp_path, values, separator, comma, bom, newline, blank, comments, digits
) -> None:
    cells = [f"{value:.{digits}g}" for value in values]
    expected = np.array(cells, dtype=float)
    assume(np.ptp(expected) > 1e-9 * np.abs(expected).max())
    rows = [f"{k / 4}{separator}{cell}" for k, cell in enumerate(cells)]
    if comma and separator != ",":
        rows = [row.replace(".", ",") for row in rows]
    lines = ["# a comment"] * comments + [f"time_s{separator}displacement_m", *rows] + [""] * blank
    path = tmp_path / "record.csv"
    path.write_bytes((newline.join(lines) + newline).encode("utf-8-sig" if bom else "utf-8"))
    record = read_record(path)
    np.testing.assert_array_equal(record.values, expected)
    np.testing.assert_array_equal(record["time"].values, np.arange(len(cells)) / 4)
