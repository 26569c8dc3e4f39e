"""The table of releases weighed together."""

from __future__ import annotations

import pytest

from experiments.pasco_together import KINDS, NUMBERS, TEXTS, assemble, rows


@pytest.mark.parametrize(
    ("viscous", "friction", "words"), [(0.95, 2.6, ("reached", "reached")), (0.5, 2.9, ("missed", "missed"))]
)
def test_the_targets_are_damping_found_and_friction_unmoved(
    viscous: float, friction: float, words: tuple[str, str]
) -> None:
    texts = dict.fromkeys(TEXTS, "") | {"candidates": '[{"effects": [], "probability": 1.0}]', "unit": "N m"}
    numbers = dict.fromkeys(NUMBERS, 0.1)
    results = [
        numbers | texts | {"viscous": 0.01, "friction": 2.5},
        numbers | texts | {"viscous": viscous, "friction": friction},
    ]
    table = rows(assemble([{"kind": kind} for kind in KINDS], results))
    assert len(table) == 3
    assert table[0].paper == ""
    assert words == (table[1].remark.split(";")[0], table[2].remark)
