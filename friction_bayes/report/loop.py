"""The page of a closed loop: the verdict, the numbers, the figures, and how to make it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from friction_bayes.core.text import interval90, listed, number, percent, set_words
from friction_bayes.loop.result import LoopReport
from friction_bayes.report.page import figure_block, page, pairs, paragraphs, section, table, tiles
from friction_bayes.report.story import CHANNELS, loop_story, verdict_sentence

__all__ = ["loop_page"]

_MOST_CANDIDATES = 12


def loop_page(report: LoopReport, figures: Mapping[str, bytes], manifest: Mapping[str, Any]) -> str:
    """Return the page of a report.

    Parameters
    ----------
    report : LoopReport
    figures : mapping of str to bytes
        SVG of each of :func:`friction_bayes.plotting.loop.loop_figures`.
    manifest : mapping
        Seed, options, inputs and versions, from :func:`friction_bayes.core.files.manifest`.

    Returns
    -------
    str
        HTML that holds its figures and loads nothing.
    """
    told = report.to_dict()
    names = listed([trace.name for trace in report.traces])
    return page(
        f"{names}: {report.verdict}",
        _header(names, told),
        tiles(_tiles(told)),
        section(
            "What explains the residual",
            figure_block(
                figures["candidates"],
                "Every set of effects that was weighed on the same data, with its posterior probability.",
            ),
            _effects(told["effects"]),
        ),
        section(
            "Friction",
            figure_block(
                figures["friction"],
                "Friction with 90 % intervals. After: averaged over the candidates, so that what the record "
                "cannot decide widens the interval.",
            ),
        ),
        *_records(report, figures),
        section("Is what is left noise?", _tests(told)),
        section("The whole story", pairs(loop_story(told)[1:])),
        section("All candidates", _candidates(told["candidates"]), folded=True),
        section("Steps of the search", paragraphs("\n".join(told["trail"]) or "none"), folded=True),
        section("How this was made", _made(manifest)),
    )


def _header(names: str, told: Mapping[str, Any]) -> str:
    badge = f'<span class="badge {escape(told["verdict"])}">{escape(told["verdict"])}</span>'
    following = told["next_experiment"]
    extra = f'<p class="next"><b>Next experiment.</b> {escape(following)}</p>\n' if following else ""
    return (
        f"<header>\n<h1>Closing the loop on {escape(names)}</h1>\n"
        f'<p class="verdict">{badge}{escape(verdict_sentence(told))}</p>\n{extra}</header>'
    )


def _tiles(told: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    before, after, error = told["friction_before"], told["friction_after"], told["held_out_error"]
    unit = after["unit"]
    known = error["before"] and error["after"] is not None
    noise = told["noise"]
    colour = (
        "white"
        if noise["model"] == "white"
        else f"correlated over {number(noise['correlation_length_s'], 3)} s"
    )
    return [
        ("friction before", f"{number(before['mean'])} {unit}", f"90 %: {interval90(before)}"),
        ("friction after", f"{number(after['mean'])} {unit}", f"90 %: {interval90(after)}"),
        (
            "forecast error, after / before",
            number(error["after"] / error["before"] if known else None, 2),
            f"{number(error['before'], 3)} → {number(error['after'], 3)} {error['unit']}, held out",
        ),
        ("noise", f"{number(noise['sd'], 3)} {error['unit']}", colour),
    ]


def _effects(effects: Sequence[Mapping[str, Any]]) -> str:
    if not effects:
        return paragraphs("No effect beyond Coulomb friction.")
    rows = []
    for effect in effects:
        parameters = effect["parameters"].items() or [("", {"mean": None, "sd": None, "unit": ""})]
        for i, (name, p) in enumerate(parameters):
            unit = "" if p["unit"] == "1" else p["unit"]
            first = (effect["name"].replace("_", " "), percent(effect["probability"]))
            values = (f"{number(p['mean'])} {unit}", f"{number(p['sd'], 2)} {unit}")
            rows.append([*(first if i == 0 else ("", "")), name.replace("_", " "), *values])
    return table(("effect", "probability that it acts", "parameter", "mean", "sd"), rows)


_CAPTIONS = {
    "signal": "The record with the Coulomb model alone (before) and the final model (after); below, the "
    "shaded parts.",
    "residual": "Residual before and after, each on its own scale, against time, phase and amplitude. What "
    "follows the motion is a missing effect; noise does not.",
    "turning_points": "Amplitude at the turning points, and what each half cycle takes from it: a constant "
    "is dry friction, a slope viscous damping, a parabola drag.",
    "force": "The friction force that was measured, and what both models make of it.",
}


def _records(report: LoopReport, figures: Mapping[str, bytes]) -> list[str]:
    several = len(report.traces) > 1
    return [
        section(
            f"Record {trace.name}" if several else "Record",
            *(
                figure_block(figures[name], text)
                for kind, text in _CAPTIONS.items()
                if (name := f"{kind}_{i}" if several else kind) in figures
            ),
        )
        for i, trace in enumerate(report.traces, start=1)
    ]


def _tests(told: Mapping[str, Any]) -> str:
    before, after = (told["residual"][when] for when in ("before", "after"))
    names = list(dict.fromkeys([*before["channels"], *after["channels"]]))
    rows = [
        [name.replace("_", " "), CHANNELS.get(name, ""), _outcome(before, name), _outcome(after, name)]
        for name in names
    ]
    rate = percent(after["false_alarm_rate"])
    return table(
        ("test", "looks at", "before", "after"), rows, [name in after["failed"] for name in names]
    ) + paragraphs(
        f"p-values. If what is left were noise, any of the tests would fail in {rate} of all records.", "note"
    )


def _outcome(tests: Mapping[str, Any], name: str) -> str:
    channel = tests["channels"].get(name)
    if channel is None:
        return "–"
    p = channel["p_value"]
    shown = "< 1e-12" if p is not None and p < 1e-12 else number(p, 2)
    return f"{'fails' if name in tests['failed'] else 'passes'}, {shown}"


def _candidates(candidates: Sequence[Mapping[str, Any]]) -> str:
    rows = [
        [set_words(c["effects"]), percent(c["probability"]), f"{c['probability']:.2e}"]
        for c in candidates[:_MOST_CANDIDATES]
    ]
    left = len(candidates) - _MOST_CANDIDATES
    more = paragraphs(f"{left} more in report.json.", "note") if left > 0 else ""
    return table(("effects", "probability", ""), rows) + more


def _made(manifest: Mapping[str, Any]) -> str:
    options = {
        name: value
        for name, value in manifest["options"].items()
        if value not in (None, False, []) and name not in ("out", "force", "json")
    }
    versions = {name: version for name, version in manifest["versions"].items() if version}
    rows = [
        ("seed", str(manifest["seed"])),
        *((entry["record"], f"sha256 {entry['sha256']}") for entry in manifest["inputs"]),
        ("options", ", ".join(f"{name.replace('_', '-')} {value}" for name, value in options.items())),
        ("versions", ", ".join(f"{name} {version}" for name, version in versions.items())),
    ]
    return pairs(rows)
