"""Angles and counters that start over are continued; what merely leaps is left as it is."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import friction_bayes as fb
from friction_bayes.records.readers.starting_over import continued

TIME = np.arange(800) / 100.0
SWING = np.cos(9.0 * TIME) * (1.0 - 0.1 * TIME)


@pytest.mark.parametrize(("swing", "rest"), [(60.0, 8.0), (60.0, 330.0), (700.0, 20.0), (5.0, 0.3)])
def test_an_angle_read_modulo_a_turn(swing: float, rest: float, tmp_path: Path) -> None:
    angle = np.round(rest + swing * SWING, 1)
    path = tmp_path / "disc.csv"
    rows = zip(TIME.tolist(), np.mod(angle, 360.0).tolist(), strict=True)
    path.write_text("time_s,angle_deg\n" + "".join(f"{t},{a:.1f}\n" for t, a in rows))
    with pytest.warns(
        fb.RecordWarning, match="start over every 360, as at a full turn: they are continued, "
    ):
        record = fb.read_record(path)
    turns = (np.rad2deg(record.values) - angle) / 360.0
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-9)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_counter(bits: int) -> None:
    size = 2**bits
    counts = np.floor(0.3 * size + 0.6 * size * SWING)
    with pytest.warns(fb.RecordWarning, match=rf"every {size}, as of a counter of {bits} bits"):
        found = continued(np.mod(counts, size), None, "disc.csv")
    np.testing.assert_array_equal(found - found[0], counts - counts[0])


def test_a_scaled_counter_has_a_turn_of_its_own(tmp_path: Path) -> None:
    counts = np.mod(np.floor(300.0 + 700.0 * SWING), 2000)
    path = tmp_path / "encoder.csv"
    path.write_text("time_s,counts\n" + "".join(f"{t},{n:.0f}\n" for t, n in zip(TIME, counts, strict=True)))
    with pytest.warns(fb.RecordWarning, match="start over every 2000, as at a full turn"):
        fb.read_record(path, quantity="angle", unit="counts/rad", scale=2000.0 / (2.0 * math.pi))


def test_what_leaps_otherwise_is_left(rng: np.random.Generator) -> None:
    level = np.floor(3000.0 + 800.0 * SWING)
    dropped = level.copy()
    dropped[200:207] = 0.0
    slipped = level + 2500.0 * (TIME > 4.0)
    square = np.where(SWING > 0.0, 255.0, 0.0)
    for values in (level, dropped, slipped, square, rng.integers(0, 256, 800).astype(float)):
        assert continued(values, None, "record") is values
    angle = 300.0 + 50.0 * SWING
    angle[300] = 0.0
    assert continued(angle, 360.0, "record") is angle
