"""The page of a closed loop and its story: complete, self-contained, safe from what a record is called."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from browser import BROWSER, needs_browser, opened
from friction_bayes.core.files import manifest
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.plotting import figure_files
from friction_bayes.plotting.loop import loop_figures
from friction_bayes.report.loop import loop_page
from friction_bayes.report.residual_tests import meaning
from friction_bayes.report.story import known_within, loop_story, shown_parameters, verdict_sentence

VOID = {"meta", "img", "br"}


class Outline(HTMLParser):
    """Tags, what images and links point to, and whether every tag is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.targets: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.targets += [value or "" for name, value in attrs if name in {"src", "href"}]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture
def drawn() -> dict[str, bytes]:
    """Placeholders for the figures of one record."""
    names = ("candidates", "friction", "signal", "residual", "turning_points")
    return {name: f"<svg><title>{name}</title></svg>".encode() for name in names}


def made() -> dict[str, Any]:
    options = {"records": ["decay.csv"], "noise": "auto", "force": True, "exclude": None}
    return manifest("close-loop", options=options, seed=3, inputs={"decay.csv": "a" * 64})


def page_of(report: LoopReport, figures: Mapping[str, bytes]) -> str:
    return loop_page(report.to_dict(), [trace.name for trace in report.traces], figures, made())


def outline(html: str) -> Outline:
    found = Outline()
    found.feed(html)
    found.close()
    assert found.open == []
    return found


def test_page(loop_report: LoopReport, drawn: Mapping[str, bytes]) -> None:
    html = page_of(loop_report, drawn)
    found = outline(html)
    assert found.tags.count("img") == 5
    assert all(target.startswith("data:image/svg+xml;base64,") for target in found.targets)
    assert "script" not in found.tags
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]
    said = " ".join(found.words)
    for word in (
        "ambiguous",
        "friction after",
        "0.53 N",
        "viscous damping + quadratic drag",
        "passes, 0.4",
        "fails, < 1e-12",
        "Add a record released from half the amplitude.",
        "sha256 " + "a" * 64,
        "noise auto",
        "numpy",
    ):
        assert word in said
    assert "averaged over the candidates" in said
    assert html == page_of(loop_report, drawn)


def test_few_tests_are_named_and_by_what_they_mean(
    loop_report: LoopReport, drawn: Mapping[str, bytes]
) -> None:
    fails, passes = {"p_value": 1e-14}, {"p_value": 0.4}
    before = dict.fromkeys(
        [
            "force_by_velocity",
            "force_by_position",
            "force_by_amplitude",
            "force_by_time",
            "force_by_stop",
            "whiteness",
        ],
        fails,
    )
    after = dict.fromkeys(before, passes) | dict.fromkeys(["tails", "force_jumps", "spectrum"], fails)
    residual = {
        "before": loop_report.residual["before"] | {"channels": before, "failed": [*before]},
        "after": loop_report.residual["after"]
        | {"channels": after, "failed": ["tails", "force_jumps", "spectrum"]},
    }
    html = page_of(replace(loop_report, residual=residual), drawn)
    named = [test for test in after if meaning(test) in html]
    # those that lines name, three of each, and one more in the table
    assert named == [
        "force_by_velocity",
        "force_by_position",
        "force_by_amplitude",
        "force_by_time",
        "tails",
        "force_jumps",
        "spectrum",
    ]
    first = ", ".join(f"random force against {what}" for what in ("velocity", "position", "amplitude"))
    assert f"{first} and 3 more" in html
    assert "2 more in report.json" in html
    assert not any(f">{name}<" in html for name in after)


def test_names_are_text_and_not_markup(loop_report: LoopReport, drawn: Mapping[str, bytes]) -> None:
    trace = replace(loop_report.traces[0], name='<script>alert("x")</script>')
    html = page_of(replace(loop_report, traces=(trace,)), drawn)
    assert "script" not in outline(html).tags
    assert "&lt;script&gt;" in html


def test_each_record_has_its_figures(loop_report: LoopReport, drawn: Mapping[str, bytes]) -> None:
    trace = loop_report.traces[0]
    several = {f"{name}_{i}": svg for name, svg in drawn.items() for i in (1, 2)} | dict(drawn)
    report = replace(loop_report, traces=(trace, replace(trace, name="another")))
    found = outline(page_of(report, several))
    assert found.tags.count("img") == 8
    said = " ".join(found.words)
    assert "Record another" in said
    assert "The records cannot separate" in said
    assert "what the records cannot decide" in said


@pytest.fixture
def page(loop_report: LoopReport, tmp_path: Path) -> Path:
    """A page with its real figures."""
    file = tmp_path / "report.html"
    drawn = {}
    for name, figure in loop_figures(loop_report).items():
        drawn[name] = figure_files(figure, ("svg",))["svg"]
    file.write_text(page_of(loop_report, drawn), encoding="utf-8")
    return file


@needs_browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_for_everybody_at_any_width(scheme: str, page: Path) -> None:
    """Nothing is wider than a telephone, nothing is loaded, and axe finds no barrier."""
    axe = pytest.importorskip(
        "axe_core_python.sync_playwright", reason="barriers are found by axe-core-python"
    )
    narrow = {"width": 400, "height": 800}
    with opened(viewport=narrow, color_scheme=scheme, bypass_csp=True) as browser:
        asked: list[str] = []
        browser.on("request", lambda request: asked.append(request.url))
        browser.goto(page.as_uri())
        assert {url.partition(":")[0] for url in asked} <= {"file", "data"}
        assert browser.get_by_text("What to do next").bounding_box()["y"] < narrow["height"]
        browser.evaluate("document.querySelectorAll('details').forEach(each => each.open = true)")
        assert browser.evaluate("document.documentElement.scrollWidth") == narrow["width"]
        assert axe.Axe().run(browser)["violations"] == []


@needs_browser
def test_page_in_a_browser(page: Path, tmp_path: Path) -> None:
    shot = tmp_path / "shot.png"
    command = [
        str(BROWSER),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--no-first-run",
        "--hide-scrollbars",
        "--enable-logging=stderr",
        "--window-size=1100,4200",
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--screenshot={shot}",
        page.as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr
    image = np.rint(255.0 * mpl.image.imread(shot)[..., :3]).astype(int)
    assert image.shape[:2] == (4200, 1100)
    colours = {"bars and lines of the final model": "#0b4f8a", "the Coulomb model": "#d55e00"}
    for what, colour in colours.items():
        wanted = np.rint(255.0 * np.array(mpl.colors.to_rgb(colour))).astype(int)
        assert np.count_nonzero((np.abs(image - wanted) <= 3).all(axis=-1)) > 200, what


@pytest.mark.parametrize(
    ("verdict", "best", "words"),
    [
        ("adequate", [], "Coulomb friction alone explains"),
        ("explained", ["quadratic_drag"], "with quadratic drag explains the record (70.0 %)"),
        (
            "ambiguous",
            ["viscous_damping"],
            "viscous damping (70.0 %) and friction drift (29.0 %); friction is averaged",
        ),
        ("unexplained", ["quadratic_drag"], "quadratic drag, which is not an explanation"),
    ],
)
def test_verdict_in_a_sentence(verdict: str, best: list[str], words: str, loop_report: LoopReport) -> None:
    first = {"effects": best, "probability": 0.7}
    candidates = [first, *loop_report.candidates[1:]]
    report = replace(loop_report, verdict=verdict, because=("left_over",), candidates=candidates)
    assert words in verdict_sentence(report.to_dict())


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("adequate", "Coulomb friction with viscous damping explains the records: "),
        ("explained", "explains the records (70.0 %)"),
        ("ambiguous", "The records cannot separate viscous damping"),
        ("unexplained", "What is left of the records is neither"),
    ],
)
def test_several_records_are_not_called_one(verdict: str, words: str, loop_report: LoopReport) -> None:
    report = replace(loop_report, verdict=verdict, because=("left_over",))
    assert words in verdict_sentence(report.to_dict(), 2)


def test_what_tests_see_and_does_not_matter_is_not_called_noise(loop_report: LoopReport) -> None:
    report = replace(loop_report, verdict="explained").to_dict()
    assert "what is left is noise" in verdict_sentence(report)
    report["residual"]["after"]["passes"] = False
    assert "what is left is too little to matter" in verdict_sentence(report)


def test_one_law_with_and_without_a_random_force_is_said_to_be_that(loop_report: LoopReport) -> None:
    candidates = [
        {"effects": ["quadratic_drag", "random_force"], "probability": 0.6},
        {"effects": ["quadratic_drag"], "probability": 0.38},
        {"effects": [], "probability": 0.02},
    ]
    sentence = verdict_sentence(replace(loop_report, verdict="ambiguous", candidates=candidates).to_dict())
    assert sentence.startswith("Coulomb friction with quadratic drag explains the record.")
    assert "60.0 % that it does, 38.0 % that it does not" in sentence
    assert "a longer record or a further release" in sentence


def test_effects_that_no_probable_candidate_lacks_are_not_in_doubt(loop_report: LoopReport) -> None:
    candidates = [
        {"effects": ["sensor_drift"], "probability": 0.9},
        {"effects": ["asymmetric_friction", "sensor_drift"], "probability": 0.08},
        {"effects": [], "probability": 0.02},
    ]
    sentence = verdict_sentence(replace(loop_report, verdict="ambiguous", candidates=candidates).to_dict())
    assert "sensor drift (8.0 %); all have sensor drift, and friction is averaged over them." in sentence


def test_the_headline_says_at_once_that_friction_is_agreed_on(
    loop_report: LoopReport, drawn: Mapping[str, bytes]
) -> None:
    report = replace(loop_report, friction_agreed=True)
    reported = dict(loop_story(report.to_dict()))["verdict"]
    assert reported.startswith(
        "AMBIGUOUS which effect, friction is agreed on: The record cannot separate viscous"
    )
    assert reported.endswith("Friction is known within -16 and +16 %, with 90 % probability.")
    said = " ".join(" ".join(outline(page_of(report, drawn)).words).split())
    assert "ambiguous which effect, friction is agreed on: The record cannot separate" in said
    open_too = dict(loop_story(loop_report.to_dict()))["verdict"]
    assert open_too.startswith("AMBIGUOUS: The record cannot separate")
    assert open_too.endswith("friction is averaged over them.")
    explained = replace(report, verdict="explained")
    assert dict(loop_story(explained.to_dict()))["verdict"].startswith("EXPLAINED: Coulomb friction with")


def test_coulomb_friction_that_may_be_none_is_said_to_be_that(loop_report: LoopReport) -> None:
    candidates = [{"effects": [], "probability": 0.97}, {"effects": ["presliding"], "probability": 0.03}]
    report = replace(loop_report, candidates=candidates, dry_friction={"probability": 0.8, "upper95": 0.1})
    sentence = verdict_sentence(report.to_dict())
    assert sentence.startswith("Coulomb friction explains the record (97.0 %), but the probability that dry")
    assert "only 80.0 %" in sentence


@pytest.mark.parametrize(
    ("failed", "matters", "said"),
    [
        (["lines", "whiteness"], 0.99, "but what it leaves is not noise (failed tests: "),
        (["lines", "whiteness"], 0.8, "matters is only 80.0 %"),
        ([], 0.02, "matters is only 2.0 %"),
    ],
)
def test_one_law_that_is_no_explanation_says_why(
    loop_report: LoopReport, failed: list[str], matters: float, said: str
) -> None:
    candidates = [{"effects": ["presliding"], "probability": 0.97}, {"effects": [], "probability": 0.03}]
    after = loop_report.residual["after"] | {"failed": failed, "passes": not failed}
    report = replace(
        loop_report,
        candidates=candidates,
        residual=loop_report.residual | {"after": after},
        dry_friction={"probability": matters, "upper95": 0.1},
    )
    assert said in verdict_sentence(report.to_dict())


def test_story_has_every_line(loop_report: LoopReport) -> None:
    reported = dict(loop_story(loop_report.to_dict()))
    assert reported["friction after"].startswith("0.53 N   sd 0.05   90 %: 0.447")
    assert reported["effects"].startswith("viscous damping   71.0 %   damping ratio 0.002 ± 5e-05")
    assert "4e-04 m before" in reported["held-out error"] or "0.0004 m before" in reported["held-out error"]
    assert "ratio 0.25" in reported["held-out error"]
    assert reported["residual before"].endswith("fails 1 of 2 tests: correlation between samples")
    assert reported["residual after"].endswith("passes all 1 tests")
    assert reported["sensor noise"] == "sd 0.0001 m, autoregressive of order 3, correlated over 0.02 s"
    assert reported["paper's procedure"].endswith(
        "\ndisagrees, because of viscous damping (71.0 %); its interval is too wide, as successive drops "
        "share a peak"
    )
    assert "inside the 90 % interval; error +30 % before, +6 % after" in reported["reference"]
    assert "next experiment" in reported
    assert reported["random force"].startswith(
        "probability 99.0 %; sd 0.1 ± 0.01 N over all candidates, 20 % of friction, correlated over 0.05 s"
    )
    assert reported["left over"].startswith("1e-05 m of the signal (0.05 % of the amplitude)")


@pytest.mark.parametrize(
    ("narrow", "wide", "words"),
    [
        (
            0.12,
            -0.03,
            "friction would move by 0.12 sd with priors of effects ten times as narrow and by -0.03 sd with "
            "priors of effects ten times as wide",
        ),
        (
            None,
            0.13,
            "friction would move by 0.13 sd with priors of effects ten times as wide; "
            "ten times as narrow: cannot be computed from these draws",
        ),
        (
            None,
            None,
            "how far friction moves with priors of effects ten times as narrow or as "
            "wide cannot be computed from these draws",
        ),
    ],
)
def test_what_the_priors_of_effects_do_to_friction(
    narrow: float | None, wide: float | None, words: str, loop_report: LoopReport
) -> None:
    report = replace(loop_report, prior_sensitivity={"0.1": narrow, "10": wide})
    assert dict(loop_story(report.to_dict()))["prior"] == words


@pytest.mark.parametrize(
    ("probability", "low", "words"),
    [
        (0.01, 0.0, "none can be seen; 95 % upper limit 0.6 N"),
        (0.01, 0.4, "acts, and takes a small part of the loss; 95 % upper limit 0.6 N"),
        (0.55, 0.0, "matters with a probability of 55.0 %; 95 % upper limit 0.6 N"),
        (0.99, 0.4, "matters with a probability of 99.0 %"),
    ],
)
def test_dry_friction_that_is_uncertain_has_a_limit(
    probability: float, low: float, words: str, loop_report: LoopReport
) -> None:
    report = replace(
        loop_report,
        dry_friction=loop_report.dry_friction | {"probability": probability},
        friction_after=loop_report.friction_after | {"interval90": [low, 0.6]},
    )
    assert dict(loop_story(report.to_dict()))["dry friction"] == words


def test_a_force_that_follows_the_motion_is_named(loop_report: LoopReport) -> None:
    left = loop_report.left | {"depends_on": "position", "shape": "a bump in the middle", "share": 0.71}
    unexplained = replace(loop_report, verdict="unexplained", because=("left_over",))
    report = replace(unexplained, left=left).to_dict()
    assert "depends on the position" in verdict_sentence(report)
    assert "71.0 % of it like a bump in the middle" in verdict_sentence(report)
    reported = dict(loop_story(report))["left over"]
    assert reported.startswith("a force that depends on the position")
    assert reported.endswith("a bump in the middle describes it best: 71.0 % of it")
    report = replace(unexplained, left=left | {"share": 0.02}).to_dict()
    assert "like a bump" not in verdict_sentence(report)
    assert "no simple shape describes it" in dict(loop_story(report))["left over"]


def test_candidates_that_explain_nothing_have_no_probability(
    loop_report: LoopReport, drawn: dict[str, bytes]
) -> None:
    summary = {"sd": 0.01, "interval90": [0.4, 0.6], "unit": "N"}
    readings = [
        {"what": "Coulomb friction alone", "mean": 0.65} | summary,
        {"what": "the closest candidates", "mean": 0.5} | summary,
    ]
    spread = {"low": 0.5, "high": 0.65, "unit": "N", "readings": readings}
    effects = [effect | {"probability": 0.99999} for effect in loop_report.effects]
    candidates = [loop_report.candidates[0] | {"probability": 0.99999}, *loop_report.candidates[1:]]
    report = replace(
        loop_report,
        verdict="unexplained",
        because=("left_over",),
        friction_range=spread,
        effects=effects,
        candidates=candidates,
    )
    reported = dict(loop_story(report.to_dict()))
    assert reported["friction range"].startswith(
        "between 0.5 N (the closest candidates) and 0.65 N (Coulomb friction alone)"
    )
    assert reported["closest effects"] == "viscous damping   damping ratio 0.002 ± 5e-05, Q 250 ± 6.2"
    assert "%" not in reported["closest candidates"]
    assert {"effects", "candidates", "prior"}.isdisjoint(reported)
    page = loop_page(report.to_dict(), ["record"], drawn, made())
    assert 'class="closest"' in page
    assert "99.9 %" not in page
    assert "friction range" in page
    assert "averaged over the candidates, and as wide as what is left" in page


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("shift", "What is left of the record could shift friction by 0.01 N, more than half"),
        ("band", "Only 35.0 % of the part held out lies in its 90 % band"),
        ("forecast", "worse than by Coulomb friction alone: the error is 1.5 times as large"),
        ("witnesses", "the loss of amplitude says 0.5 N, the shape within a cycle -0.2"),
        ("records", "friction is 0.5 N in low and 0.7 N in high, 40 % more; it differs between the records"),
    ],
)
def test_what_forbids_to_use_the_number_is_said(fault: str, words: str, loop_report: LoopReport) -> None:
    between = {
        "probability": 0.99,
        "records": [
            {"name": name, "friction": {"mean": mean, "unit": "N"}}
            for name, mean in (("high", 0.7), ("low", 0.5))
        ],
    }
    report = replace(
        loop_report,
        verdict="unexplained",
        because=(fault,),
        held_out_error=loop_report.held_out_error | {"after": 6e-4, "inside90": 0.35},
        friction_between_records=between,
    )
    sentence = verdict_sentence(report.to_dict())
    assert words in sentence
    assert sentence.endswith("viscous damping, which is not an explanation.")


def test_records_that_contradict_an_effect_are_said_to(loop_report: LoopReport) -> None:
    report = replace(
        loop_report,
        verdict="unexplained",
        because=("records",),
        friction_between_records={"probability": 0.2, "records": []},
    )
    assert "contradict each other in an effect that they share" in verdict_sentence(report.to_dict(), 2)


def test_the_verdict_says_which_part_a_sampler_went_over(loop_report: LoopReport) -> None:
    sampler = {
        "friction": {"mean": 0.5, "sd": 0.01, "interval90": [0.48, 0.52], "unit": "N"},
        "agrees": True,
        "sampled": {"effects": ["viscous_damping"], "probability": 0.6},
    }
    report = replace(loop_report, reference_check={"sampler": sampler}).to_dict()
    sentence = verdict_sentence(report)
    assert "one part of the posterior, viscous damping (60.0 %), without slight effects" in sentence
    assert "0.5 N   sd 0.01   90 %: 0.48 .. 0.52, with which the closed form agrees." in sentence
    del report["reference_check"]["sampler"]["friction"]
    assert "could not go over viscous damping (60.0 %)" in verdict_sentence(report)


def test_a_law_without_a_forecast_says_why(loop_report: LoopReport) -> None:
    error = loop_report.held_out_error | {"after": float("nan")}
    reported = dict(loop_story(replace(loop_report, held_out_error=error).to_dict()))["held-out error"]
    assert "the law that was found cannot be fitted to the first 70 %" in reported


@pytest.mark.parametrize(
    ("interval", "words"),
    [((1e-4, 1.64), "within -100 and +64 %"), ((0.99, 1.012), "within -1 and +1.2 %")],
)
def test_how_well_friction_is_known(interval: tuple[float, float], words: str) -> None:
    assert words in known_within({"mean": 1.0, "interval90": list(interval), "unit": "N"})


def test_a_damping_ratio_comes_with_its_quality_factor(
    loop_report: LoopReport, drawn: dict[str, bytes]
) -> None:
    reported = dict(loop_story(loop_report.to_dict()))["effects"]
    # Q = 1 / (2 * 0.002), with the relative sd of the ratio, 5e-5 / 0.002
    assert reported.endswith("damping ratio 0.002 ± 5e-05, Q 250 ± 6.2")
    assert "<td>Q</td><td>250 </td>" in page_of(loop_report, drawn)
    slight = {"damping_ratio": {"mean": 1e-5, "sd": 9e-6, "unit": "1"}}
    effects = [loop_report.effects[0] | {"parameters": slight}]
    assert "Q" not in dict(loop_story(replace(loop_report, effects=effects).to_dict()))["effects"]


def test_each_of_several_lines_is_reported(loop_report: LoopReport, drawn: dict[str, bytes]) -> None:
    def line(frequency: float, decay_time: float | None, record: int = 0) -> dict[str, Any]:
        dies_out = None if decay_time is None else {"mean": decay_time, "sd": 0.28, "unit": "s"}
        return {
            "record": record,
            "frequency": {"mean": frequency, "sd": 0.009, "unit": "Hz"},
            "decay_time": dies_out,
            "amplitude": {"mean": 0.003, "sd": 2e-4, "unit": "m"},
        }

    def reported(lines: list[dict[str, Any]]) -> LoopReport:
        return replace(loop_report, effects=[loop_report.effects[0] | {"lines": lines}])

    both = reported([line(14.3, 2.29), line(26.9, None)])
    texts = [
        "line at 14.3 ± 0.009 Hz, dies out in 2.29 ± 0.28 s, amplitude 0.003 ± 0.0002 m",
        "line at 26.9 ± 0.009 Hz, amplitude 0.003 ± 0.0002 m",
    ]
    assert [text.strip() for text in dict(loop_story(both.to_dict()))["effects"].split("\n")[1:]] == texts
    assert all(f">{text}</td>" in page_of(both, drawn) for text in texts)
    # one in each record is what the parameters say
    one_each = reported([line(14.3, 2.29), line(14.2, 2.1, record=1)])
    assert "line at" not in dict(loop_story(one_each.to_dict()))["effects"]
    assert "line at" not in page_of(one_each, drawn)


def test_story_of_what_could_not_be_had(loop_report: LoopReport) -> None:
    report = replace(
        loop_report,
        effects=[],
        next_experiment=None,
        reference_check=None,
        paper_procedure={"friction": None, "disagrees": True, "because": [], "why": "it is clipped"},
        held_out_error=loop_report.held_out_error | {"before": float("nan"), "after": float("nan")},
    )
    reported = dict(loop_story(report.to_dict()))
    assert reported["paper's procedure"] == "no result: it is clipped"
    assert reported["held-out error"].startswith(
        "– m before, – m after (Coulomb friction alone cannot be fitted"
    )
    assert {"effects", "next experiment", "reference", "emcee"}.isdisjoint(reported)


def test_story_of_another_frequency(loop_report: LoopReport) -> None:
    reported = dict(loop_story(loop_report.to_dict()))
    assert reported["frequency"] == "10 ± 0.001 rad/s, declared 10.1 rad/s"
    frequency = loop_report.frequency | {"declared": 3.0, "from_stiffness": 0.05, "from_mass": 0.5}
    reported = dict(loop_story(replace(loop_report, frequency=frequency).to_dict()))
    assert "0.05 N with the declared stiffness, 0.5 N with the declared mass" in reported["frequency"]


def test_story_of_a_measured_force(loop_report: LoopReport) -> None:
    force = {"before": 0.1, "after": 0.02, "level": 0.5, "unit": "N"}
    explained = {"explained_by_law": 0.91, "explained_with_fluctuation": None}
    reported = _reported_of_force(loop_report, force | explained)
    first = "RMS difference 0.1 N before, 0.02 N after; mean during the motion 0.5 N"
    assert reported == f"{first}\nthe law alone explains 91.0 % of its variance"
    reported = _reported_of_force(loop_report, force | explained | {"explained_with_fluctuation": 0.98})
    assert reported.endswith("the law alone explains 91.0 % of its variance, with the fluctuation 98.0 %")


def _reported_of_force(report: LoopReport, force: dict[str, Any]) -> str:
    residual = report.residual | {"force": force}
    return dict(loop_story(replace(report, residual=residual).to_dict()))["measured force"]


def test_story_of_the_sampler(loop_report: LoopReport) -> None:
    word = {"mean": 0.5, "sd": 0.01, "interval90": [0.48, 0.52], "unit": "N"}
    sampler = {
        "friction": word,
        "rhat": 1.001,
        "ess_bulk": 800.0,
        "agrees": False,
        "because": "the means differ by 5 standard errors",
        "sampled": {"effects": ["viscous_damping"], "probability": 0.6},
        "sampler_s": 12.0,
    }
    lines = dict(loop_story(replace(loop_report, reference_check={"sampler": sampler}).to_dict()))["emcee"]
    for words in ("took 12.0 s", "R-hat 1.001", "DOES NOT AGREE", "differ by 5"):
        assert words in lines
    refused = {"sampler": {"converged": False, "agrees": None, "because": "not sampled: too long"}}
    refused["sampler"]["sampled"] = sampler["sampled"]
    reported = dict(loop_story(replace(loop_report, reference_check=refused).to_dict()))
    assert reported["emcee"] == "not sampled: too long"


def test_terms_beyond_those_of_a_series_are_not_shown() -> None:
    reported = {
        "once_sine": {"mean": 0.0, "sd": 0.1, "unit": "N m"},
        "twice_sine": {"mean": 0.0, "sd": 0.0, "unit": "N m"},
    }
    assert [*shown_parameters({"parameters": reported})] == ["once_sine"]


def test_steps_of_the_search_are_reported_in_words(
    loop_report: LoopReport, drawn: Mapping[str, bytes]
) -> None:
    steps = [
        "about viscous_damping+random_force: 95 sets",
        "friction_drift has a probability of 3.6 %: left out",
    ]
    html = page_of(replace(loop_report, trail=steps), drawn)
    assert "about viscous damping + random force: 95 sets" in html
    assert "friction drift has a probability of 3.6 %: left out" in html
