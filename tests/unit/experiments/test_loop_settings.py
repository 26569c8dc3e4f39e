"""Each setting of the loop is varied alone, and only while the loop is closed."""

from __future__ import annotations

import dataclasses

import pytest

from experiments.loop_settings import EXPERIMENT, Config, assemble, cells, details, rows, using
from friction_bayes.loop import settings


def test_a_setting_is_varied_and_put_back() -> None:
    before = settings.SETTINGS
    with using("false_alarm_rate", 2.0):
        assert (
            dataclasses.replace(before, false_alarm_rate=pytest.approx(2.0 / 101.0, rel=1e-12))
            == settings.SETTINGS
        )
    with using("most_at_once", 0.5):
        assert settings.SETTINGS.most_at_once == 2
    assert settings.SETTINGS is before


def test_what_moves_is_reported_of_each_setting() -> None:
    found = {
        "report": ["a", ""],
        "verdict": ["adequate", "refused"],
        "mean": [1.0, None],
        "sd": [0.1, None],
        "width": [0.3, None],
    }
    every = cells(Config(), full=False)
    results = [found] * len(every)
    results[2] = found | {
        "report": ["b", ""],
        "verdict": ["ambiguous", "refused"],
        "mean": [1.05, None],
        "width": [0.36, None],
    }
    dataset = assemble(every, results)
    assert [row.ours for row in rows(dataset)[:3]] == [
        str(len(every) // 2),
        str(len(every) // 2 - 1),
        f"1 of {len(every) - 1}",
    ]
    first, *others = details(dataset)
    assert first["setting"] == f"`{every[1]['setting']}`"
    assert (first["halved"], first["doubled"]) == ("nothing", "1 verdicts, 0.5 sd, 20 %")
    assert {other["doubled"] for other in others} == {"nothing"}


def test_the_same_noise_for_every_setting() -> None:
    assert set(EXPERIMENT.paired) == set(cells(Config(), full=False)[0])
