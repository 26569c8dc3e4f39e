"""Figures of a closed loop: candidates and their probabilities, friction by each, and all at a glance."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from friction_bayes.core.summary import TAILS
from friction_bayes.core.text import percent, set_words
from friction_bayes.loop.report.result import LoopReport
from friction_bayes.loop.report.verdict import UNEXPLAINED
from friction_bayes.plotting.fluctuation import plot_fluctuation
from friction_bayes.plotting.forecast import plot_forecast
from friction_bayes.plotting.loop_record import (
    draw_signal,
    plot_loop_force,
    plot_loop_residual,
    plot_loop_signal,
    plot_turning_points,
)
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, TRUTH, caption, new_figure, styled

__all__ = [
    "loop_figures",
    "plot_candidates",
    "plot_fluctuation",
    "plot_forecast",
    "plot_friction_between_records",
    "plot_loop",
    "plot_loop_force",
    "plot_loop_friction",
    "plot_loop_residual",
    "plot_loop_signal",
    "plot_turning_points",
]

_MOST_BARS = 8
_FEWEST_BARS = 3
_COUNTS = 5e-4
_LEAST_DRAWS = 40
"""Draws of friction that a candidate needs for an interval of its own."""
_MOST_INTERVALS = 6
_LABEL = 44
"""Characters in a line of a label."""
_MOST_LINES = 2
"""Lines of a label that have room in letters of the usual size."""
_SMALL = 6.5


def _records(report: LoopReport) -> str:
    first, others = report.traces[0].name, len(report.traces) - 1
    return f"{first} and {others} more" if others else first


def _set_label(effects: Sequence[str]) -> str:
    """Name a set of effects in lines short enough to leave room for the axes."""
    return fill(set_words(effects), _LABEL, break_on_hyphens=False)


def _name_rows(axes: Axes, labels: Sequence[str]) -> None:
    """Write a label at each row, in smaller letters where one of three lines would reach into the next."""
    lines = max(label.count("\n") for label in labels) + 1
    axes.set_yticks(range(len(labels)), labels)
    if lines > _MOST_LINES:
        axes.tick_params(axis="y", labelsize=_SMALL)


def _head(figure: Figure, text: str) -> None:
    """Title over the whole width: next to long labels the axes have no room for it."""
    figure.suptitle(text, fontweight="bold", fontsize=11.0, x=0.01, ha="left")


def _bars(report: LoopReport) -> int:
    """Candidates with a bar of their own: those that count, a few at least, and one rather than "1 other"."""
    counting = sum(c["probability"] >= _COUNTS for c in report.candidates)
    bars = min(max(counting, _FEWEST_BARS), _MOST_BARS)
    return bars + 1 if len(report.candidates) == bars + 1 else bars


def _draw_candidates(axes: Axes, report: LoopReport) -> None:
    count = _bars(report)
    shown, rest = report.candidates[:count], report.candidates[count:]
    labels = [_set_label(c["effects"]) for c in shown]
    values = [float(c["probability"]) for c in shown]
    if rest:
        labels.append(f"{len(rest)} others together")
        values.append(float(sum(c["probability"] for c in rest)))
    places = list(range(len(values)))
    trusted = report.verdict != UNEXPLAINED
    colors = [MODEL if trusted else FAINT] + [DATA if trusted else FAINT] * (len(values) - 1)
    axes.barh(places, values, height=0.62, color=colors)
    if trusted:
        for place, value in zip(places, values, strict=True):
            axes.text(value + 0.012, place, percent(value), va="center", fontsize=9.0)
    _name_rows(axes, labels)
    axes.set_ylim(len(values) - 0.4, -0.6)
    axes.set_xlim(0.0, 1.14)
    axes.tick_params(axis="y", left=False)
    if trusted:
        axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "25 %", "50 %", "75 %", "100 %"])
        axes.set_xlabel("posterior probability")
    else:
        # a share among candidates none of which is true is no probability of any
        axes.set_xticks([])
        axes.set_xlabel("closeness: none of them is an explanation")


def plot_candidates(report: LoopReport) -> Figure:
    """Draw the sets of effects that were evaluated and how probable each is.

    Parameters
    ----------
    report : LoopReport

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(8.0, 1.3 + 0.34 * min(len(report.candidates), _bars(report) + 1))
        axes = figure.add_subplot()
        _draw_candidates(axes, report)
        _head(figure, f"{_records(report)}: candidates")
    return figure


def _friction_rows(report: LoopReport) -> list[tuple[str, float, float, float, str]]:
    """Label, mean, interval and colour, from top to bottom."""
    rows = []
    paper = report.paper_procedure.get("friction")
    if paper is not None:
        rows.append(("paper's procedure", paper["mean"], *paper["interval90"], DATA))
    before, after = report.friction_before, report.friction_after
    rows.append(("before: Coulomb alone", before["mean"], *before["interval90"], ACCENT))
    mixture = report.posterior["mixture"]
    which, draws = (np.ravel(np.asarray(mixture[name])) for name in ("candidate", "friction"))
    several = []
    for i, candidate in enumerate(report.candidates):
        own = draws[which == i]
        if own.size >= _LEAST_DRAWS:
            low, high = np.quantile(own, TAILS)
            several.append((f"  {_set_label(candidate['effects'])}", float(own.mean()), low, high, FAINT))
    if len(several) > 1:
        rows += several[:_MOST_INTERVALS]
    readings = report.friction_range["readings"] if report.friction_range else []
    rows += [(f"  {r['what']}", r["mean"], *r["interval90"], FAINT) for r in readings[1:]]
    rows.append(("after", after["mean"], *after["interval90"], MODEL))
    return rows


def _draw_friction(axes: Axes, report: LoopReport) -> None:
    rows = _friction_rows(report)
    for place, (label, mean, low, high, color) in enumerate(rows):
        bold = not label.startswith("  ")
        line = color if bold else DATA
        axes.plot([low, high], [place] * 2, color=line, lw=3.0 if bold else 1.4)
        axes.plot([mean], [place], "o", ms=6.5 if bold else 4.0, color=line)
    reference = (report.reference_check or {}).get("friction")
    if isinstance(reference, float | int):
        axes.axvline(reference, color=TRUTH, lw=1.2, ls=":")
        caption(axes, f"dotted: reference {reference:.4g} {report.friction_after['unit']}")
    _name_rows(axes, [label.strip() for label, *_ in rows])
    for text, (label, *_) in zip(axes.get_yticklabels(), rows, strict=True):
        text.set_color("#666666" if label.startswith("  ") else "#111111")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.tick_params(axis="y", left=False)
    axes.locator_params(axis="x", nbins=6)
    axes.set_xlabel(f"friction [{report.friction_after['unit']}], 90 % intervals")


def plot_loop_friction(report: LoopReport) -> Figure:
    """Draw friction by the paper's procedure, before, by each candidate, and after.

    Parameters
    ----------
    report : LoopReport

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(8.0, 1.2 + 0.32 * len(_friction_rows(report)))
        axes = figure.add_subplot()
        _draw_friction(axes, report)
        _head(figure, f"{_records(report)}: friction")
    return figure


def plot_friction_between_records(report: LoopReport) -> Figure:
    """Draw each record's friction with its 90 % interval, their mean, and the spread between them.

    Parameters
    ----------
    report : LoopReport
        Of several records that were fitted together.

    Returns
    -------
    matplotlib.figure.Figure
    """
    between, after = report.friction_between_records, report.friction_after
    assert between is not None
    rows = [(record["name"], record["friction"]) for record in between["records"]]
    with styled():
        figure = new_figure(8.0, 1.4 + 0.32 * (len(rows) + 1))
        axes = figure.add_subplot()
        if between["spread"]:
            sd = between["spread"]["mean"]
            axes.axvspan(after["mean"] - sd, after["mean"] + sd, color=FAINT, alpha=0.35, lw=0.0)
        for place, (_, friction) in enumerate([*rows, ("mean", after)]):
            color = MODEL if place == len(rows) else DATA
            axes.plot(friction["interval90"], [place] * 2, color=color, lw=2.2)
            axes.plot([friction["mean"]], [place], "o", ms=5.0, color=color)
        axes.set_yticks(range(len(rows) + 1), [*(name for name, _ in rows), "mean"])
        axes.set_ylim(len(rows) + 0.5, -0.5)
        axes.tick_params(axis="y", left=False)
        axes.locator_params(axis="x", nbins=6)
        axes.set_xlabel(f"friction [{after['unit']}], 90 % intervals; shaded: mean and spread")
        _head(figure, f"friction between records: differs at {percent(between['probability'])}")
    return figure


def plot_loop(report: LoopReport) -> Figure:
    """Draw a report at a glance: the first record, its residual, the candidates and friction.

    Parameters
    ----------
    report : LoopReport

    Returns
    -------
    matplotlib.figure.Figure
    """
    trace = report.traces[0]
    with styled():
        figure = new_figure(11.0, 7.4)
        grid = figure.add_gridspec(2, 2)
        signal, candidates, friction = (figure.add_subplot(grid[p]) for p in ((0, 0), (0, 1), (1, 1)))
        draw_signal(signal, trace)
        others = len(report.traces) - 1
        signal.set_title(f"{trace.name}, first of {others + 1} records" if others else trace.name)
        low, high = signal.get_ylim()
        signal.set_ylim(low, high + 0.2 * (high - low))
        signal.legend(loc="upper right", ncols=3)
        stacked = grid[1, 0].subgridspec(2, 1)
        upper = figure.add_subplot(stacked[0])
        lower = figure.add_subplot(stacked[1], sharex=upper, sharey=upper)
        free = trace.sides == 0.0
        for axes, model, name in ((upper, trace.before, "before"), (lower, trace.after, "after")):
            error = (trace.signal - model)[free]
            axes.plot(trace.time[free], error, ".", ms=1.8, mew=0.0, color=DATA, rasterized=True)
            axes.axhline(0.0, color="#444444", lw=0.6)
            axes.set_title(f"residual {name}: RMS {report.residual[name]['rms']:.3g} {trace.unit}")
            axes.set_ylabel(f"[{trace.unit}]")
        upper.tick_params(labelbottom=False)
        lower.set_xlabel("time [s]")
        _draw_candidates(candidates, report)
        comes = "comes closest" if report.verdict == UNEXPLAINED else "explains the residual"
        candidates.set_title(f"what {comes}: {report.verdict}")
        _draw_friction(friction, report)
        friction.set_title("friction")
    return figure


def loop_figures(report: LoopReport) -> dict[str, Figure]:
    """Draw every figure of the page of a report, by name; those of several records carry their number.

    Parameters
    ----------
    report : LoopReport
    """
    figures = {
        "candidates": plot_candidates(report),
        "friction": plot_loop_friction(report),
    }
    if report.friction_between_records is not None:
        figures["friction_between_records"] = plot_friction_between_records(report)
    for i, trace in enumerate(report.traces, start=1):
        suffix = f"_{i}" if len(report.traces) > 1 else ""
        figures[f"signal{suffix}"] = plot_loop_signal(trace)
        figures[f"residual{suffix}"] = plot_loop_residual(trace)
        figures[f"turning_points{suffix}"] = plot_turning_points(trace)
        if trace.forecasts is not None:
            figures[f"forecast{suffix}"] = plot_forecast(trace)
        if trace.fluctuation is not None:
            of_it = trace.name == report.left["record"]
            figures[f"fluctuation{suffix}"] = plot_fluctuation(
                trace,
                report.left["depends_on"] if of_it else None,
                report.left["shape"] if of_it else None,
            )
        if trace.forces is not None:
            figures[f"force{suffix}"] = plot_loop_force(trace, unit=report.friction_after["unit"])
    return figures
