"""The page of an estimate: complete, self-contained, and the same words as the table of the terminal."""

from __future__ import annotations

from dataclasses import replace
from html import unescape

import pytest

import friction_bayes as fb
from decays import SYSTEM, short_decay
from friction_bayes.core.files import manifest
from friction_bayes.report.estimate import EstimatedRecord, estimate_page
from friction_bayes.report.estimate_story import estimate_story

FIGURES = {name: f"<svg><title>{name}</title></svg>".encode() for name in ("amplitudes", "friction", "joint")}


@pytest.fixture
def entry() -> EstimatedRecord:
    estimate = fb.estimate(short_decay(duration=6.0, seed=5), SYSTEM, method="normal-gamma")
    return EstimatedRecord(result=estimate.to_dict(), read="two columns; fitted 0 to 6 s", figures=FIGURES)


def page_of(*entries: EstimatedRecord) -> str:
    options = {"records": ["decay.csv"], "method": "normal-gamma"}
    return unescape(
        estimate_page(entries, manifest("estimate", options=options, seed=3, inputs={"decay.csv": "a" * 64}))
    )


def test_page_tells_what_the_table_tells(entry: EstimatedRecord) -> None:
    page = page_of(entry)
    for label, text in [*estimate_story(entry.result), ("read", entry.read)]:
        assert f"<dt>{label}</dt><dd>{text}</dd>" in page
    friction = entry.result["friction"]
    assert f"Friction is {friction['mean']:.4g} N. Friction is known within" in page
    assert "sha256 " + "a" * 64 in page
    assert page.count("<img ") == page.count('src="data:image/svg+xml;base64,') == 3
    assert "<script" not in page
    assert page == page_of(entry)


def test_warnings_stand_above_the_numbers(entry: EstimatedRecord) -> None:
    warned = replace(entry, warnings=["do not take friction from this record"])
    for page in (page_of(warned), page_of(warned, entry)):
        head, _, rest = page.partition('<dl class="tiles">')
        assert "<b>Warning:</b> do not take friction from this record" in head
        assert "Warning" not in rest


def test_a_friction_that_may_be_zero_has_no_percentages(entry: EstimatedRecord) -> None:
    friction = entry.result["friction"] | {"interval90": [-0.6, 0.7]}
    force = {"probability": 1.0, "sd": friction, "share_of_friction": 730.0, "correlation_time": friction}
    doubtful = replace(entry, result=entry.result | {"friction": friction, "random_force": force})
    assert doubtful.sentence.endswith("It lies between -0.6 and 0.7 N, with 90 % probability.")
    assert not any("% of friction" in text for _, text in doubtful.story)
    positive = replace(entry, result=entry.result | {"random_force": force})
    assert any("73000 % of friction" in text for _, text in positive.story)


def test_several_records_have_a_table_first_and_figures_each(entry: EstimatedRecord) -> None:
    other = replace(entry, result=entry.result | {"record": "<b>other</b>"})
    options = manifest("estimate", options={}, seed=1)
    page = estimate_page([entry, other], options)
    assert page.count("<img ") == 6
    assert page.index('<th scope="col">frequency</th>') < page.index("<img ")
    assert "&lt;b&gt;other&lt;/b&gt;" in page
    assert "<b>other" not in page


def test_what_the_interval_rests_on_is_one_clause_each(entry: EstimatedRecord) -> None:
    force = {
        "probability": 0.97,
        "sd": entry.result["friction"],
        "share_of_friction": 0.2,
        "correlation_time": entry.result["friction"],
    }
    noise = {"model": "coloured", "filter": None, "probability_of_free_corners": 0.58}

    def rests_on(**changed: object) -> str:
        result = entry.result | {"random_force": force, "noise": entry.result["noise"] | noise | changed}
        return dict(estimate_story(result))["it rests on"]

    assert rests_on().startswith("coloured noise of the sensor and a force that fluctuates: probability 97")
    assert "; a filter that colours noise may also have" in rests_on()
    assert "the turning points (probability 58.0 %) do not" in rests_on()
    gained = rests_on(filter={"name": "a moving mean", "gain": 0.9874})
    assert "sensor, behind a moving mean: the 1.26 % that it takes of the motion is put back and" in gained
    doubted = rests_on(filter={"name": "a moving mean", "gain": 0.9874, "probability": 0.8})
    assert "sensor, behind a filter with probability 80.0 %, such as a moving mean: the 1.26 %" in doubted
    kept = rests_on(filter={"name": "a moving mean", "gain": 1.0 - 1e-9})
    assert "sensor, behind a moving mean and a force" in kept
