"""The page of a closed loop: the verdict, the numbers, the figures, and how to make it again."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from friction_bayes.core.text import interval90, number, of_friction, set_words, words
from friction_bayes.loop.report.verdict import UNEXPLAINED
from friction_bayes.mechanics.effects import EFFECTS
from friction_bayes.report.page import FigureInWords, render_page, reproduction
from friction_bayes.report.residual_tests import meaning, shown_tests
from friction_bayes.report.story import (
    friction_agreed,
    loop_grounds,
    loop_story,
    next_step,
    shown_lines,
    shown_parameters,
    summary_of,
    the_records,
    verdict_sentence,
)

__all__ = ["loop_page"]

_MOST_CANDIDATES = 12
_FIGURES = {
    "signal": FigureInWords(
        "The record over time with the Coulomb model alone and with the final model",
        "The record with the Coulomb model alone (before) and the final model (after); below, the "
        "shaded parts enlarged.",
    ),
    "residual": FigureInWords(
        "Residual before and after, against time, phase and amplitude",
        "Residual before and after, each on its own scale, against time, phase and amplitude. What "
        "follows the motion is a missing effect; noise does not.",
    ),
    "turning_points": FigureInWords(
        "Amplitude at the turning points, and its loss in each half cycle",
        "Amplitude at the turning points, and its loss in each half cycle: constant for dry "
        "friction, a straight line for viscous damping, a parabola for drag.",
    ),
    "forecast": FigureInWords(
        "The last 30 % of the record and its forecast by both models",
        "The last 30 % of the moving record, forecast by both models fitted to the part before, with "
        "the predictive 90 % band of the final one; below, what is measured less what is forecast.",
    ),
    "fluctuation": FigureInWords(
        "The force that the law does not explain, over time and against the motion",
        "The force that the law does not explain, with its 90 % band: over time, and against "
        "velocity, position and amplitude with means in bins (bars: two standard errors). A random force "
        "follows none of them; a line that stays away from zero by more than its bars is an effect that the "
        "catalogue lacks, and the shape of it.",
    ),
    "force": FigureInWords(
        "The measured friction force and that of both models over time",
        "The measured friction force, and that of both models.",
    ),
}
"""Figures of a record, in the order of the page."""
_FOLDED = ("turning_points", "forecast", "fluctuation", "force")
_BETWEEN = FigureInWords(
    "Friction of each record with its 90 % interval",
    "Friction of each record with its 90 % interval, the mean, and the spread between records where there is "
    "one.",
)


def _compared(report: Mapping[str, Any], records: int) -> FigureInWords:
    """The figure of the candidates in words."""
    caption = "Every set of effects that was compared on the same data, with its posterior probability."
    if report["verdict"] == UNEXPLAINED:
        caption = (
            f"Every set of effects that was compared on the same data. None explains {the_records(records)}: "
            "a bar is its share among them, not a probability that it acts."
        )
    best = set_words(report["candidates"][0]["effects"])
    return FigureInWords(f"Bars of the candidates; the longest is {best}", caption)


def _intervals(report: Mapping[str, Any], records: int) -> FigureInWords:
    """The figure of friction in words."""
    what = the_records(records)
    after = f"averaged over the candidates, so that the interval includes what {what} cannot decide."
    if report["verdict"] == UNEXPLAINED:
        after = (
            f"averaged over the candidates, and as wide as what is left of {what} could shift it, as none "
            "explains it."
        )
    return FigureInWords(
        "Friction before and after with 90 % intervals", f"Friction with 90 % intervals. After: {after}"
    )


def loop_page(
    report: Mapping[str, Any],
    records: Sequence[str],
    figures: Mapping[str, bytes],
    manifest: Mapping[str, Any],
) -> str:
    """Return the page of a report.

    Parameters
    ----------
    report : mapping
        Fields of ``report.json``.
    records : sequence of str
        Names of the records.
    figures : mapping of str to bytes
        SVG of each of :func:`friction_bayes.plotting.loop.loop_figures`.
    manifest : mapping
        Seed, options, inputs and versions, from :func:`friction_bayes.core.files.manifest`.

    Returns
    -------
    str
        HTML that holds its figures and loads nothing.
    """
    count = len(records)
    tests = shown_tests(report["residual"])
    known = {name for when in ("before", "after") for name in report["residual"][when]["channels"]}
    return render_page(
        "loop.html",
        report=report,
        unexplained=report["verdict"] == UNEXPLAINED,
        records=records,
        drawings=figures,
        figures=_FIGURES,
        folded_figures=_FOLDED,
        compared=_compared(report, count),
        intervals=_intervals(report, count),
        between_records=_BETWEEN,
        agreed=friction_agreed(report),
        sentence=verdict_sentence(report, count),
        summary=_tiles(report),
        rests_on=loop_grounds(report),
        next=next_step(report),
        tests=tests,
        other_tests=len(known) - len(tests),
        meaning=meaning,
        shown_lines=shown_lines,
        shown_parameters=shown_parameters,
        summary_of=summary_of,
        story=[*loop_story(report, count)[1:], *(("note", text) for text in report["notes"])],
        most_candidates=_MOST_CANDIDATES,
        steps=[_in_words(step) for step in report["trail"]],
        made=reproduction(manifest),
    )


def _in_words(step: str) -> str:
    """Write the names of effects in a step of the loop as people read them."""
    named = rf"\b({'|'.join(EFFECTS)})\b(\+(?=[a-z]))?"
    return re.sub(named, lambda found: words(found[1]) + (" + " if found[2] else ""), step)


def _tiles(report: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Label, value and remark of the numbers that matter most."""
    before, after, error = report["friction_before"], report["friction_after"], report["held_out_error"]
    unit = after["unit"]
    known = error["before"] and error["after"] is not None
    noise = report["noise"]
    colour = (
        "white"
        if noise["model"] == "white"
        else f"correlated over {number(noise['correlation_length_s'], 3)} s"
    )
    tiles = [
        ("friction after", f"{number(after['mean'])} {unit}", f"90 %: {interval90(after)}"),
        ("friction before", f"{number(before['mean'])} {unit}", f"90 %: {interval90(before)}"),
        (
            "forecast error, after / before",
            number(error["after"] / error["before"] if known else None, 2),
            f"{number(error['before'], 3)} → {number(error['after'], 3)} {error['unit']}, held out",
        ),
        ("sensor noise", f"{number(noise['sd'], 3)} {error['unit']}", colour),
    ]
    force = report["random_force"]
    if force is not None and force["probability"] > 0.5:
        time = number(force["correlation_time_s"]["mean"], 2)
        size = f"sd {number(force['sd']['mean'], 3)} {unit}"
        share = of_friction(force["share_of_friction"], after["interval90"])
        tiles.append(("random force", size, f"correlated over {time} s{share}"))
    return tiles
