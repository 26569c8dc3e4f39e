"""A report in one line and as a table, and the experiment it proposes where nothing explains the record."""

from __future__ import annotations

import pytest

from friction_bayes.loop.report.next_experiment import experiment_on_unexplained
from friction_bayes.loop.report.result import LoopReport


def test_one_line(loop_report: LoopReport) -> None:
    said = "LoopReport(ambiguous, closest: viscous damping; friction 0.53 N, 90 %: 0.4478 .. 0.6123)"
    assert repr(loop_report) == said


def test_summary_is_a_table_of_quantities(loop_report: LoopReport) -> None:
    table = loop_report.summary()
    assert list(table.index) == [
        "friction_before",
        "friction_after",
        "viscous_damping.damping_ratio",
        "frequency",
        "noise_sd",
    ]
    assert table.loc["friction_after", "eti90_lb"] == pytest.approx(0.53 - 1.645 * 0.05)
    assert table.loc["viscous_damping.damping_ratio", "sd"] == 5e-5
    assert list(table["unit"]) == ["N", "N", "1", "rad/s", "m"]


@pytest.mark.parametrize(
    ("depends_on", "failed", "words"),
    [
        ("velocity", ["force_by_velocity"], "half and from twice the amplitude"),
        ("position", ["whiteness"], "Move the sensor"),
        ("amplitude", [], "half the amplitude"),
        ("time", [], "at once without touching it"),
        (None, ["whiteness", "tails"], "at rest with the same sensor"),
        (None, ["whiteness", "force_by_velocity"], "Repeat the release twice"),
        (None, [], "Repeat the release twice"),
    ],
)
def test_what_to_measure_next_where_nothing_explains(
    depends_on: str | None, failed: list[str], words: str
) -> None:
    sentence = experiment_on_unexplained(depends_on, failed, [], 1)
    assert words in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence


def test_several_records_that_nothing_explains_are_to_be_looked_at_one_by_one() -> None:
    assert "each record by itself" in experiment_on_unexplained(None, ["force_by_velocity"], [], 2)
    assert "half the amplitude" in experiment_on_unexplained("amplitude", [], [], 2)
    assert "--varying-friction" in experiment_on_unexplained("amplitude", [], ["records"], 2)
