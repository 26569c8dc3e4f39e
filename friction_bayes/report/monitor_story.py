"""What monitoring says, line by line and point by point: one text for the terminal and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from friction_bayes.core.text import interval90, number, with_interval
from friction_bayes.monitor.points import COUNTED, per
from friction_bayes.monitor.report import MonitorReport

__all__ = [
    "Rows",
    "fleet_rows",
    "fleet_title",
    "memory",
    "monitor_rows",
    "monitor_story",
    "next_monitoring",
    "story_of_monitor",
]

Rows = tuple[list[str], list[list[str]]]
"""Headings of a table, whose units are on a line of their own, and its cells."""

_NAMED = 0.01
"""Laws of wear less probable than this are not shown."""
_ALL, _NEARLY_NOTHING = 0.995, 0.05
"""Shares of what was known, kept from point to point, that are written as all and as nearly nothing."""
_BETTER, _FAR_BETTER = 1.0, 5.0
"""Gains in log-density of all forecasts together that are written in these words."""


def monitor_rows(result: Mapping[str, Any]) -> Rows:
    """Return the detection points of a machine, the first two columns in words.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it.
    """
    unit = result["health_assessment"]["friction"]["unit"]
    time_unit = result["data_acquisition"]["time_unit"]
    forgetting, plain = (result["state_detection"][name]["friction"] for name in ("forgetting", "plain"))
    # the names of counted points are their times
    counted = time_unit == COUNTED
    headings = ["point", "record", *([] if counted else [f"time\n[{time_unit}]"])]
    headings += [f"record alone\n[{unit}]", f"with forgetting\n[{unit}]", "90 % interval"]
    headings.append(f"without forgetting\n[{unit}]")
    points = zip(
        result["data_acquisition"]["points"],
        result["data_manipulation"]["points"],
        forgetting,
        plain,
        strict=True,
    )
    rows = [
        [
            acquired["point"],
            acquired["record"],
            *([] if counted else [f"{acquired['time']:.6g}"]),
            number(found["friction"]["mean"]),
            number(tracked["mean"]),
            interval90(tracked),
            number(late["mean"]),
        ]
        for acquired, found, tracked, late in points
    ]
    return headings, rows


def monitor_story(result: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and text of each line on a machine.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it, with ``notes``.
    """
    detected, health = result["state_detection"], result["health_assessment"]
    lines = [("forgetting", memory(detected["forgetting"], detected["plain"]))]
    for name in ("drift", "diffusion", "scatter"):
        value = health[name]
        lines.append((name, f"{number(value['mean'])} {value['unit']}   sd {number(value['sd'])}"))
    prognosis = result["prognostic_assessment"]
    if prognosis is not None:
        time_unit = result["data_acquisition"]["time_unit"]
        already, never = (prognosis[f"probability_{name}"] for name in ("reached_already", "never_reached"))
        lines += [
            ("threshold", f"{health['threshold']:g} {health['friction']['unit']}"),
            ("remaining life", _life(prognosis["remaining_life"], f" {time_unit}")),
            ("probabilities", f"already reached {already:.2g}, never reached {never:.2g}"),
            ("laws of wear", _laws(prognosis["laws_of_wear"])),
        ]
    lines.append(("advice", result["advisory_generation"]["text"]))
    return lines + [("note", text) for text in result["notes"]]


def story_of_monitor(report: MonitorReport) -> list[tuple[str, str]]:
    """The lines of :func:`monitor_story` of a report, the friction at its last point first."""
    notes = dict.fromkeys(text for known in report.manipulation for text in known.get("notes", ()))
    result = report.to_dict() | {"notes": list(notes)}
    return [("friction", with_interval(result["health_assessment"]["friction"])), *monitor_story(result)]


def next_monitoring(result: Mapping[str, Any]) -> str:
    """Say what to do next.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it.
    """
    case = result["advisory_generation"]["case"]
    if case == "no_threshold":
        return "Give --threshold, the friction that must not be reached: the remaining life is then found."
    if case == "threshold_passed":
        return "Stop the machine and see to it. The first record after a repair begins a new series."
    if case == "not_approaching":
        return "Go on recording as before: the next record shows whether it stays so."
    soonest, _ = result["prognostic_assessment"]["remaining_life"]["interval90"]
    when = (
        f"within {_time(soonest, ' ' + result['data_acquisition']['time_unit'])} from now"
        if soonest
        else "now"
    )
    return f"Take the next record {when}: each one narrows the interval."


def fleet_title(result: Mapping[str, Any]) -> str:
    """Say how large a fleet is, and how many of its records could not be used."""
    acquired = result["data_acquisition"]
    title = f"{acquired['machines']} machines, {acquired['detection_points']} detection points"
    unusable = result["data_manipulation"]["records_not_usable"]
    return f"{title}, {unusable} records not usable" if unusable else title


def fleet_rows(result: Mapping[str, Any], most: int) -> Rows:
    """Return the most urgent machines of a fleet.

    Parameters
    ----------
    result : mapping
        As in ``monitor.json`` of a fleet.
    most : int
        Machines at most.
    """
    health, prognoses = result["health_assessment"], result["prognostic_assessment"]
    unit, time_unit = health["unit"], result["data_acquisition"]["time_unit"]
    headings = ["machine", "points", f"friction\n[{unit}]", f"drift\n[{per(unit, time_unit)}]"]
    if prognoses is not None:
        headings += [f"remaining life\n[{time_unit}]", "90 % interval", "never\nreached"]
    rows = []
    for k, each in enumerate(health["machines"][:most]):
        known = (number(_known(each[name]["mean"])) for name in ("friction", "drift"))
        row = [each["machine"], str(each["points_used"]), *known]
        if prognoses is not None and each["status"] == "ok":
            life, never = prognoses[k]["remaining_life"], prognoses[k]["probability_never_reached"]
            row += [_time(life["median"]), _interval(life), f"{never:.2g}"]
        elif prognoses is not None:
            row += [each["status"], "–", "–"]
        rows.append(row)
    return headings, rows


def memory(forgetting: Mapping[str, Any], plain: Mapping[str, Any]) -> str:
    """Say how much of the past counts, and what the forecasts gain by it."""
    kept = forgetting["discount"]
    if kept >= _ALL:
        return "none: all points so far count alike"
    if kept < _NEARLY_NOTHING:
        text = "nearly all from point to point: the latest record alone counts"
    else:
        lost = 1.0 - kept
        text = (
            f"{100.0 * lost:.0f} % of what was known from point to point: about {1.0 / lost:.2g} points count"
        )
    gain = forgetting["log_predictive"] - plain["log_predictive"]
    word = "far better" if gain > _FAR_BETTER else "better" if gain > _BETTER else "hardly better"
    return f"{text}; this forecasts the next record {word} than forgetting nothing"


def _laws(probabilities: Mapping[str, float]) -> str:
    """Name the laws that matter, the most probable first."""
    ordered = sorted(probabilities.items(), key=lambda item: -item[1])
    return ", ".join(f"{law} {share:.2f}" for law, share in ordered if share >= _NAMED)


def _life(life: Mapping[str, Any], unit: str) -> str:
    return f"{_time(life['median'], unit)}   90 %: {_interval(life, unit)}"


def _interval(life: Mapping[str, Any], unit: str = "") -> str:
    low, high = life["interval90"]
    return f"{_time(low)} .. {_time(high, unit)}"


def _time(value: float | None, unit: str = "") -> str:
    return "never" if value is None or value == float("inf") else f"{value:.4g}{unit}"


def _known(value: float) -> float | None:
    return None if value != value else value
