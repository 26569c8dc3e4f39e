"""What the page shows of a file, right or wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import friction_bayes as fb
from decays import short_decay
from friction_bayes.app.understood import curve, understand


def test_columns_and_record(tmp_path: Path) -> None:
    path = fb.write_record(short_decay(seed=1), tmp_path / "decay.csv")
    whole = understand(path, {})
    assert whole.columns == {"time_s": "time [s]", "displacement_m": "displacement [m]"}
    assert whole.sentence.startswith("displacement_m [m] over time_s [s]: ")
    later = understand(path, {"start": 1.0})
    assert later.record is not None
    assert later.whole is not None
    assert later.record.size < later.whole.size == whole.record.size


def test_what_is_unclear_is_reported_in_the_words_of_the_page(tmp_path: Path) -> None:
    path = tmp_path / "weg.csv"
    time = np.arange(400) / 100.0
    rows = (f"{t:.2f};{9.0 * np.cos(9.0 * t):.4f}".replace(".", ",") for t in time)
    path.write_text("Zeit (s);Signal\n" + "\n".join(rows))
    found = understand(path, {})
    assert found.columns == {"Zeit (s)": "[s]", "Signal": ""}
    assert found.problem.startswith("weg.csv: no column says what was measured")
    assert "give “signal column”, “quantity” and “unit”" in found.problem
    mended = understand(path, {"signal_column": "Signal", "quantity": "displacement", "unit": "mm"})
    assert mended.problem == ""
    assert float(mended.record.max()) == pytest.approx(9e-3)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.csv", b"", "the file is empty"),
        ("picture.csv", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00", "picture.csv"),
        ("notes.docx", b"PK", "unknown suffix '.docx'"),
        ("torn.mat", b"MATLAB 5.0 MAT-file", "torn.mat"),
    ],
)
def test_wrong_files_are_no_accident(name: str, content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    found = understand(path, {})
    assert words in found.problem
    assert str(tmp_path) not in found.problem
    assert found.columns == {}


def test_a_long_curve_keeps_its_extremes() -> None:
    time = np.arange(100_001) / 1000.0
    values = np.cos(20.0 * time)
    values[54_321] = 7.0
    record = fb.make_record(time, values, "displacement")
    t, x = curve(record)
    assert t.size <= 4000
    assert np.all(np.diff(t) > 0.0)
    assert x.max() == 7.0
    assert t[np.argmax(x)] == time[54_321]
    assert curve(record[:100])[0].size == 100
