"""The table of releases evaluated together."""

from __future__ import annotations

import json

import pytest

from experiments.pasco_together import ANGLES, CURVES, KINDS, NUMBERS, TEXTS, assemble, rows

FIELDS = (
    dict.fromkeys(TEXTS, "")
    | dict.fromkeys(CURVES, [0.0] * ANGLES.size)
    | {"candidates": '[{"effects": [], "probability": 1.0}]', "unit": "N m"}
)


@pytest.mark.parametrize(
    ("viscous", "friction", "words"), [(0.95, 2.6, ("reached", "reached")), (0.5, 2.9, ("missed", "missed"))]
)
def test_the_targets_are_damping_found_and_friction_unmoved(
    viscous: float, friction: float, words: tuple[str, str]
) -> None:
    texts = FIELDS | {"position_force": "{}"}
    numbers = dict.fromkeys(NUMBERS, 0.1)
    results = [
        numbers | texts | {"viscous": 0.01, "friction": 2.5},
        numbers | texts | {"viscous": viscous, "friction": friction},
    ]
    table = rows(assemble([{"kind": kind} for kind in KINDS], results))
    assert len(table) == 4
    assert table[0].paper == ""
    assert words == (table[1].remark.split(";")[0], table[2].remark)
    assert table[3].ours == "not in both laws"


def test_the_force_that_repeats_with_every_turn_is_compared_between_the_kinds() -> None:
    numbers = dict.fromkeys(NUMBERS, 0.1)
    # differences of 0.3 and 0.4, each of sd 0.5, and sizes of 1 to 2 of sd 0.3 and 0.4; one series is cut
    # short, and what it lacks is not compared
    without = {"once_sine": [1.0, 0.3], "once_cosine": [2.0, 0.3], "twice_sine": [0.0, 0.0]}
    with_force = {"once_sine": [1.3, 0.4], "once_cosine": [1.6, 0.4], "twice_sine": [0.5, 0.1]}
    results = [numbers | FIELDS | {"position_force": json.dumps(force)} for force in (without, with_force)]
    row = rows(assemble([{"kind": kind} for kind in KINDS], results))[3]
    assert row.ours == "correlation 1.00; reduced chi-square of the difference 0.5, of the force 21"
