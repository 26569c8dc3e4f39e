"""A library that crashes, or comes to no end, takes its own process with it and no more."""

from __future__ import annotations

import pytest

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.own_process import arrays_read_by


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("import os; os.abort()", r"f\.bin: this is not a record \(the library that reads it crashed\)"),
        ("raise SystemExit('a wrong byte')", r"f\.bin: this is not a record \(a wrong byte\)"),
    ],
)
def test_its_end_is_one_clear_error(tmp_path, monkeypatch, code: str, said: str) -> None:
    (tmp_path / "damaged_reader.py").write_text(code, encoding="utf-8")
    (tmp_path / "f.bin").touch()
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(InputError, match=said):
        arrays_read_by("damaged_reader", tmp_path / "f.bin", "a record")


def test_it_may_not_take_for_ever(tmp_path, monkeypatch) -> None:
    (tmp_path / "endless_reader.py").write_text("while True: pass", encoding="utf-8")
    (tmp_path / "f.bin").touch()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("friction_bayes.records.readers.own_process._LONGEST", 0.3)
    with pytest.raises(InputError, match=r"f\.bin: the library that reads it has come to no end in 0 s"):
        arrays_read_by("endless_reader", tmp_path / "f.bin", "a record")


def test_arrays_come_through(tmp_path, monkeypatch) -> None:
    (tmp_path / "good_reader.py").write_text(
        "import numpy as np\n"
        "from friction_bayes.records.readers.own_process import write_arrays_of\n"
        "write_arrays_of(lambda path: {'x': np.arange(3.0), 'path': np.array(path)})\n",
        encoding="utf-8",
    )
    (tmp_path / "f.bin").touch()
    monkeypatch.syspath_prepend(tmp_path)
    arrays = arrays_read_by("good_reader", tmp_path / "f.bin", "a record")
    assert arrays["x"].tolist() == [0.0, 1.0, 2.0]
    assert str(arrays["path"]) == str(tmp_path / "f.bin")
