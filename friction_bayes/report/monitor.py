"""The page of monitoring: what follows, the figures, every point, and how to make it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from friction_bayes.core.text import interval90, number
from friction_bayes.report.monitor_story import (
    Rows,
    fleet_rows,
    fleet_title,
    monitor_rows,
    monitor_story,
    next_monitoring,
)
from friction_bayes.report.page import FigureInWords, render_page, reproduction

__all__ = ["fleet_page", "monitor_page"]

_FIGURES = {
    "detection_points": FigureInWords(
        "Posteriors of friction at the detection points, and where wear leads from the last",
        "Friction at the detection points, each posterior standing on its time, and where "
        "the laws of wear lead from the last.",
    ),
    "tracking": FigureInWords(
        "Friction by each record alone and by the posterior carried from point to point",
        "The estimate of each record alone, and the posterior that becomes the prior of the next "
        "point, with forgetting and without.",
    ),
    "remaining_life": FigureInWords(
        "Density of the remaining life and the probability to have reached the threshold",
        "The remaining life, averaged over the laws of wear: density, and probability to have "
        "reached the threshold by a time.",
    ),
}
"""Figures of a machine, in the order of the page."""
_FLEET = FigureInWords(
    "Friction of every machine over time, and the remaining life of the most urgent ones",
    "Friction of every machine over time, and the remaining life of the most urgent ones.",
)
_GROUNDS = ("forgetting", "laws of wear", "probabilities")
"""Lines of the story that say what the answer rests on."""
_MOST = 100
"""Machines of a fleet on the page."""


def monitor_page(
    result: Mapping[str, Any],
    read: Sequence[str],
    drawings: Mapping[str, bytes],
    manifest: Mapping[str, Any],
) -> str:
    """Return the page of one machine.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it, with ``notes``.
    read : sequence of str
        What was understood of the records.
    drawings : mapping of str to bytes
        SVG of each of :func:`friction_bayes.plotting.monitor.monitor_figures`.
    manifest : mapping
        Options, inputs and versions, from :func:`friction_bayes.core.files.manifest`.

    Returns
    -------
    str
        HTML that holds its figures and loads nothing.
    """
    points = result["health_assessment"]["detection_points"]
    story = monitor_story(result)
    return _page(
        title=f"Friction over {points} detection points",
        sentence=_sentence(result["advisory_generation"]["text"]),
        summary=_tiles(result),
        rests_on=[line for line in story if line[0] in _GROUNDS],
        next=next_monitoring(result),
        figures=[(drawings[name], in_words) for name, in_words in _FIGURES.items() if name in drawings],
        rows=monitor_rows(result),
        story=[*(("read", text) for text in read), *story],
        manifest=manifest,
    )


def fleet_page(result: Mapping[str, Any], drawing: bytes, manifest: Mapping[str, Any]) -> str:
    """Return the page of a fleet.

    Parameters
    ----------
    result : mapping
        As in ``monitor.json``.
    drawing : bytes
        SVG of :func:`friction_bayes.plotting.monitor.plot_fleet`.
    manifest : mapping
        Options, inputs and versions.

    Returns
    -------
    str
        HTML that holds its figure and loads nothing.
    """
    headings, rows = fleet_rows(result, _MOST)
    shown = f"The {_MOST} most urgent machines" if len(rows) == _MOST else "All machines"
    order = "the shortest remaining life first"
    if result["prognostic_assessment"] is None:
        shown, order = f"{len(rows)} machines", "in no order of urgency, as no threshold is given"
    return _page(
        title=f"Friction of {fleet_title(result)}",
        sentence=f"{shown} are listed below, {order}.",
        summary=[],
        rests_on=[],
        figures=[(drawing, _FLEET)],
        rows=(headings, rows),
        story=[],
        manifest=manifest,
    )


def _page(*, rows: Rows, manifest: Mapping[str, Any], **context: Any) -> str:
    headings, cells = rows
    return render_page(
        "monitor.html",
        headings=[heading.replace("\n", " ") for heading in headings],
        rows=cells,
        made=reproduction(manifest),
        **context,
    )


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _tiles(result: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Label, value and remark of the numbers that matter most."""
    health, prognosis = result["health_assessment"], result["prognostic_assessment"]
    friction, drift = health["friction"], health["drift"]
    tiles = [
        ("friction now", f"{number(friction['mean'])} {friction['unit']}", f"90 %: {interval90(friction)}"),
        ("drift", f"{number(drift['mean'], 3)} {drift['unit']}", f"sd {number(drift['sd'], 2)}"),
    ]
    if prognosis is not None:
        words = dict(monitor_story(result))
        life, _, interval = words["remaining life"].partition("   ")
        tiles += [
            ("remaining life", life, interval),
            ("threshold", words["threshold"], words["probabilities"]),
        ]
    return tiles
