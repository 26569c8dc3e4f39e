"""Results of monitoring as tables to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.core.text import interval90, number
from friction_bayes.monitor.points import COUNTED, per

__all__ = ["fleet_table", "memory", "monitor_table"]

_MOST = 20
"""Machines shown of a fleet; the files hold all."""
_NAMED = 0.01
"""Laws of wear less probable than this are not shown."""
_ALL, _NEARLY_NOTHING = 0.995, 0.05
"""Shares of what was known, kept from point to point, that are written as all and as nearly nothing."""
_BETTER, _FAR_BETTER = 1.0, 5.0
"""Gains in log-density of all forecasts together that are written in these words."""


def _life(low: float | None, middle: float | None, high: float | None, unit: str = "") -> str:
    return f"{_time(middle, unit)}   90 %: {_time(low)} .. {_time(high, unit)}"


def _time(value: float | None, unit: str = "") -> str:
    return "never" if value is None or value == float("inf") else f"{value:.4g}{unit}"


def memory(forgetting: Mapping[str, Any], plain: Mapping[str, Any]) -> str:
    """Say how much of the past counts, and what the forecasts gain by it."""
    kept = forgetting["discount"]
    if kept >= _ALL:
        return "none: all points so far count alike"
    if kept < _NEARLY_NOTHING:
        text = "nearly all from point to point: the latest record alone counts"
    else:
        lost = 1.0 - kept
        text = f"{lost:.0%} of what was known from point to point: about {1.0 / lost:.2g} points count"
    gain = forgetting["log_predictive"] - plain["log_predictive"]
    word = "far better" if gain > _FAR_BETTER else "better" if gain > _BETTER else "hardly better"
    return f"{text}; this forecasts the next record {word} than forgetting nothing"


def _laws(probabilities: Mapping[str, float]) -> str:
    """Name the laws that matter, the most probable first."""
    ordered = sorted(probabilities.items(), key=lambda item: -item[1])
    return ", ".join(f"{law} {share:.2f}" for law, share in ordered if share >= _NAMED)


def monitor_table(result: Mapping[str, Any], read: Sequence[str]) -> Group:
    """Lay out the detection points of a machine and what follows from them.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it, with ``notes``.
    read : sequence of str
        What was understood of each record.
    """
    unit = result["health_assessment"]["friction"]["unit"]
    time_unit = result["data_acquisition"]["time_unit"]
    forgetting, plain = (result["state_detection"][name] for name in ("forgetting", "plain"))
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("point")
    table.add_column("record", overflow="fold")
    # the names of counted points are their times
    counted = time_unit == COUNTED
    headings = [] if counted else [f"time\n[{time_unit}]"]
    headings += [f"record alone\n[{unit}]", f"with forgetting\n[{unit}]", "90 % interval"]
    for heading in (*headings, f"without forgetting\n[{unit}]"):
        table.add_column(heading, justify="right")
    for acquired, found, tracked, late in zip(
        result["data_acquisition"]["points"],
        result["data_manipulation"]["points"],
        forgetting["friction"],
        plain["friction"],
        strict=True,
    ):
        table.add_row(
            acquired["point"],
            acquired["record"],
            *([] if counted else [f"{acquired['time']:.6g}"]),
            number(found["friction"]["mean"]),
            number(tracked["mean"]),
            interval90(tracked),
            number(late["mean"]),
        )
    below = two_columns()
    for text in read:
        below.add_row("read", Text(text))
    below.add_row("forgetting", memory(forgetting, plain))
    health = result["health_assessment"]
    for name in ("drift", "diffusion", "scatter"):
        value = health[name]
        below.add_row(name, f"{number(value['mean'])} {value['unit']}   sd {number(value['sd'])}")
    prognosis = result["prognostic_assessment"]
    if prognosis is not None:
        life = prognosis["remaining_life"]
        below.add_row("threshold", f"{health['threshold']:g} {unit}")
        ends = life["interval90"]
        below.add_row("remaining life", _life(ends[0], life["median"], ends[1], f" {time_unit}"))
        below.add_row(
            "probabilities",
            f"already reached {prognosis['probability_reached_already']:.2g}, "
            f"never reached {prognosis['probability_never_reached']:.2g}",
        )
        below.add_row("laws of wear", _laws(prognosis["laws_of_wear"]))
    below.add_row("advice", Text(result["advisory_generation"]["text"], style="bold"))
    for text in result["notes"]:
        below.add_row("note", text)
    return Group(table, below)


def fleet_table(result: Mapping[str, Any]) -> Table:
    """Lay out the most urgent machines of a fleet.

    Parameters
    ----------
    result : mapping
        As in ``monitor.json`` of a fleet.
    """
    acquired, health = result["data_acquisition"], result["health_assessment"]
    machines, time_unit = health["machines"], acquired["time_unit"]
    shown = min(len(machines), _MOST)
    unusable = result["data_manipulation"]["records_not_usable"]
    title = f"{acquired['machines']} machines, {acquired['detection_points']} detection points"
    if unusable:
        title += f", {unusable} records not usable"
    table = Table(title=f"{title}; the {shown} most urgent", box=SIMPLE_HEAD, title_justify="left")
    table.add_column("machine")
    for heading in ("points", f"friction\n[{health['unit']}]", f"drift\n[{per(health['unit'], time_unit)}]"):
        table.add_column(heading, justify="right")
    prognoses = result["prognostic_assessment"]
    if prognoses is not None:
        table.add_column(f"remaining life\n[{time_unit}]")
        table.add_column("never\nreached", justify="right")
    for k, each in enumerate(machines[:shown]):
        row = [
            each["machine"],
            str(each["points_used"]),
            number(_known(each["friction"]["mean"])),
            number(_known(each["drift"]["mean"])),
        ]
        if prognoses is not None:
            life = prognoses[k]["remaining_life"]
            usable = each["status"] == "ok"
            row.append(
                _life(life["interval90"][0], life["median"], life["interval90"][1])
                if usable
                else each["status"]
            )
            row.append(f"{prognoses[k]['probability_never_reached']:.2g}" if usable else "–")
        table.add_row(*row)
    return table


def _known(value: float) -> float | None:
    return None if value != value else value
