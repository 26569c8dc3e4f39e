"""Projects of the video analysis Tracker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers import read_record, read_table
from kinds_of_files import tracker_project

FRAMES = np.arange(10, 130, 2)
SIGNAL = 0.05 * np.cos(0.3 * (FRAMES - 10))


def project(**settings: Any) -> str:
    return tracker_project(FRAMES, SIGNAL, **settings)


def saved(folder: Path, content: str) -> Path:
    path = folder / "swing.trk"
    path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize("angle", [0.0, 30.0, -90.0])
def test_positions_are_those_of_the_turned_axes(angle: float, tmp_path: Path) -> None:
    record = read_record(saved(tmp_path, project(angle=angle)), signal_column="bob x")
    np.testing.assert_allclose(record.values, SIGNAL, atol=1e-12)
    np.testing.assert_allclose(
        record["time"].values - record["time"].values[0], 0.08 * np.arange(FRAMES.size)
    )
    assert record.attrs["quantity"] == "displacement"
    assert record.attrs["units"] == "m"
    across = read_table(saved(tmp_path, project(angle=angle))).columns["bob y"].read()
    np.testing.assert_allclose(across, 0.0, atol=1e-12)


def test_tracks_without_marks_are_no_columns(tmp_path: Path) -> None:
    assert list(read_table(saved(tmp_path, project())).columns) == ["bob x", "bob y"]


def test_a_unit_is_asked_for_where_the_project_has_none(tmp_path: Path) -> None:
    path = saved(tmp_path, project(unit=None))
    record = read_record(path, signal_column="bob x", unit="cm")
    np.testing.assert_allclose(record.values, 0.01 * SIGNAL, atol=1e-14)


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (project(scale=0.0), "scale .* calibrate the video"),
        (project(step="?"), "without the time between frames"),
        (project().replace("TrackerPanel", "TFrame"), "no single video"),
        (project()[:-20], "this is not an XML file"),
        ('<!DOCTYPE o [<!ENTITY a "b">]>' + project(), "declares entities"),
    ],
)
def test_what_is_no_usable_project_is_refused(content: str, match: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=match):
        read_record(saved(tmp_path, content), signal_column="bob x")
