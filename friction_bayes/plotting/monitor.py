"""Figures of monitoring: Fig. 1 of the paper, both ways of updating, the remaining life, a fleet."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from friction_bayes.core.arrays import Array
from friction_bayes.monitor.points import per
from friction_bayes.monitor.report import MonitorReport
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, TRUTH, caption, new_figure, styled

__all__ = [
    "draw_detection_points",
    "monitor_figures",
    "plot_detection_points",
    "plot_fleet",
    "plot_remaining_life",
    "plot_tracking",
]

_LINES = ("-", "--", "-.", ":", (0, (8, 2)), (0, (1, 4)))
"""Of the laws of wear, in their order."""
_SHOWN = 0.02
"""Laws of wear less probable than this are not drawn."""
_HORIZON = 2.5
"""Most that a time axis shows of the future, in median remaining lives; or in spans of the points."""


def _end_of_axis(report: MonitorReport) -> float:
    """Last time to show: the 95 % quantile of the remaining life, or as near to it as is readable."""
    last, span = float(report.points.times[-1]), report.points.span
    if report.life is None:
        return last + 0.15 * span
    middle, high = report.life.ppf(0.5), report.life.ppf(0.95)
    scale = middle if math.isfinite(middle) else span
    return last + max(min(1.15 * high, _HORIZON * scale), 0.25 * span)


def _sideways(axes: Axes, report: MonitorReport, point: int, width: float, reach: float) -> None:
    """Draw f(r|Ti) standing on the vertical through Ti, as wide as the points leave room for."""
    time = float(report.points.times[point])
    density = report.density(point)
    sd = max(float(density.std()), 1e-9 * reach)
    level = density.mean() + sd * np.linspace(-4.0, 4.0, 161)
    height = density.pdf(level)
    shape = time + width * height / height.max()
    axes.fill_betweenx(level, time, shape, color=MODEL, alpha=0.35, lw=0.0)
    axes.plot(shape, level, color=MODEL, lw=0.9)
    axes.plot([time, time], [0.0, density.mean()], color=FAINT, lw=0.8, zorder=0)


def _fan(axes: Axes, report: MonitorReport, later: Array, top: float) -> None:
    """Draw the mean course of friction under each law of wear that matters, the likelier the darker."""
    for (law, share), line in zip(report.wear.probabilities.items(), _LINES, strict=True):
        if share < _SHOWN:
            continue
        path = report.wear.course(law, later)
        axes.plot(
            report.points.times[-1] + later,
            np.where((path >= 0.0) & (path <= top), path, np.nan),
            color=DATA,
            ls=line,
            alpha=0.3 + 0.7 * share,
            lw=1.0,
            label=f"{law}, probability {share:.2f}",
        )


def plot_detection_points(report: MonitorReport, *, title: str = "detection points") -> Figure:
    """Draw f(r|Ti) at each detection point, the threshold, and f(dt|Tn) along it: Fig. 1 of the paper.

    Parameters
    ----------
    report : MonitorReport
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    with styled():
        figure = new_figure(8.0, 4.8)
        axes = figure.add_subplot()
        draw_detection_points(axes, report)
        axes.set_title(title)
        figure.legend(loc="outside lower center", ncols=3)
    return figure


def draw_detection_points(axes: Axes, report: MonitorReport) -> None:
    """Draw what :func:`plot_detection_points` does, without title and legend."""
    points, life = report.points, report.life
    end = _end_of_axis(report)
    top = max(float(points.friction.max()), report.threshold or 0.0)
    width = 0.6 * min(float(np.diff(points.times).min()), 0.12 * (end - points.times[0]))
    for i in range(points.times.size):
        _sideways(axes, report, i, width, top)
    axes.plot(points.times, report.forgetting.mean, ".", ms=4.0, color=MODEL)
    axes.plot([], [], color=MODEL, lw=5.0, alpha=0.5, label="$f(r|T_i)$, with forgetting")
    axes.plot(points.times, report.plain.mean, "--", lw=1.1, color=TRUTH, label="mean, without forgetting")
    if report.threshold is not None and life is not None:
        axes.axhline(report.threshold, color=ACCENT, lw=1.2, ls=":", label="threshold")
        later = np.linspace(0.0, end - points.times[-1], 400)[1:]
        density = np.interp(np.log(later), np.log(life.time), life.density)
        if density.max() > 0.0:
            shown = points.times[-1] + later
            scaled = report.threshold + 0.22 * top * density / density.max()
            axes.fill_between(shown, report.threshold, scaled, color=ACCENT, alpha=0.35, lw=0.0)
            label = r"$f(\Delta t|T_n)$, not to scale"
            axes.plot(shown, scaled, color=ACCENT, lw=1.1, label=label)
        _fan(axes, report, later, 1.3 * top)
    axes.set_xlim(points.times[0] - 0.04 * (end - points.times[0]), end)
    axes.set_ylim(0.0, 1.3 * top)
    axes.set_xlabel(f"time [{points.time_unit}]")
    axes.set_ylabel(f"friction [{points.unit}]")
    above = axes.secondary_xaxis("top")
    some = range(0, points.times.size, max(points.times.size // 10, 1))
    above.set_xticks([points.times[i] for i in some], [f"$T_{{{i + 1}}}$" for i in some])


def plot_tracking(report: MonitorReport, *, title: str = "posterior becomes prior") -> Figure:
    """Draw each record's own estimate, and how far both ways of updating lie from it.

    Parameters
    ----------
    report : MonitorReport
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    points = report.points
    with styled():
        figure = new_figure(8.0, 5.0)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.0))
        upper.errorbar(
            points.times,
            points.friction,
            yerr=1.645 * points.sd,
            fmt="o",
            ms=4.5,
            color=DATA,
            capsize=2.5,
            lw=1.0,
            label="record alone, 90 % interval",
        )
        for followed, colour, marker, label in (
            (report.forgetting, MODEL, "-", f"forgetting, discount {report.forgetting.discount:.2g}"),
            (report.plain, ACCENT, "--", "without forgetting"),
        ):
            band = 1.645 * followed.sd
            upper.plot(points.times, followed.mean, marker, color=colour, label=label)
            lower.plot(points.times, followed.mean - points.friction, marker, color=colour)
            lower.fill_between(
                points.times,
                followed.mean - band - points.friction,
                followed.mean + band - points.friction,
                color=colour,
                alpha=0.25,
                lw=0.0,
            )
        lower.axhline(0.0, color=TRUTH, lw=0.8)
        upper.set_ylabel(f"friction [{points.unit}]")
        lower.set_ylabel(f"less the record's\nown [{points.unit}]")
        lower.set_xlabel(f"time [{points.time_unit}]")
        upper.set_title(title)
        upper.legend(loc="best")
        caption(lower, "shaded: 90 % intervals")
    return figure


def plot_remaining_life(report: MonitorReport, *, title: str = "remaining life") -> Figure:
    """Draw density and distribution function of the time till the threshold is reached.

    Parameters
    ----------
    report : MonitorReport
        With a threshold.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    life, unit = report.life, report.points.time_unit
    assert life is not None
    end = _end_of_axis(report) - float(report.points.times[-1])
    later = np.linspace(0.0, end, 600)[1:]
    with styled():
        figure = new_figure(7.0, 4.6)
        upper, lower = figure.subplots(2, 1, sharex=True)
        density = np.interp(np.log(later), np.log(life.time), life.density)
        upper.plot(later, density, color=MODEL)
        low, high = life.ppf(0.05), life.ppf(0.95)
        inside = (later >= low) & (later <= high)
        upper.fill_between(later[inside], density[inside], color=MODEL, alpha=0.2, lw=0.0)
        upper.set_ylabel(f"density [{per('1', unit)}]")
        upper.set_ylim(bottom=0.0)
        if inside.any():
            caption(
                upper, "shaded: 90 % interval" if math.isfinite(high) else "shaded: from the 5 % quantile"
            )
        lower.plot(later, life.cdf(later), color=MODEL, label="threshold reached")
        if life.never > 5e-4:
            ever = 1.0 - life.never
            lower.axhline(ever, color=ACCENT, lw=1.1, ls="--", label=f"ever reached: {ever:.2g}")
        if life.already > 5e-4:
            lower.axhline(
                life.already, color=TRUTH, lw=1.1, ls=":", label=f"already reached: {life.already:.2g}"
            )
        lower.set_ylim(0.0, 1.02)
        lower.set_ylabel("probability")
        lower.set_xlabel(f"time from $T_n$ [{unit}]")
        lower.legend(loc="best")
        upper.set_title(title)
    return figure


def monitor_figures(report: MonitorReport) -> dict[str, Figure]:
    """Draw every figure of one machine, by name.

    Parameters
    ----------
    report : MonitorReport
    """
    figures = {"detection_points": plot_detection_points(report), "tracking": plot_tracking(report)}
    if report.life is not None:
        figures["remaining_life"] = plot_remaining_life(report)
    return figures


def plot_fleet(fleet: xr.Dataset, *, most: int = 25, title: str = "fleet") -> Figure:
    """Draw the friction of every machine and the remaining life of the most urgent ones.

    Parameters
    ----------
    fleet : xarray.Dataset
        From :func:`friction_bayes.monitor.monitor_fleet`.
    most : int
        Machines in the right panel.
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    unit = fleet["friction_mean"].attrs["units"]
    time_unit = fleet["detection_time"].attrs["units"]
    with styled():
        figure = new_figure(9.0 if "remaining_life" in fleet else 6.0, 4.6)
        panels = figure.subplots(1, 2 if "remaining_life" in fleet else 1, squeeze=False)[0]
        left = panels[0]
        for times, friction in zip(
            fleet["detection_time"].values, fleet["friction_mean"].values, strict=True
        ):
            known = np.isfinite(friction)
            left.plot(times[known], friction[known], color=DATA, lw=0.6, alpha=0.6)
        left.set_xlabel(f"time [{time_unit}]")
        left.set_ylabel(f"friction [{unit}]")
        left.set_title(title)
        caption(left, f"{fleet.sizes['machine']} machines")
        if "remaining_life" in fleet:
            left.axhline(fleet.attrs["threshold"], color=ACCENT, lw=1.2, ls=":", label="threshold")
            figure.legend(loc="outside lower center")
            _draw_most_urgent(panels[1], fleet, most, time_unit)
    return figure


def _draw_most_urgent(axes: Axes, fleet: xr.Dataset, most: int, time_unit: str) -> None:
    life = fleet["remaining_life"].values
    known = np.flatnonzero(np.isfinite(life[:, 0]))
    order = known[np.argsort(life[known, 1], kind="stable")][:most]
    shown = life[order]
    finite = shown[np.isfinite(shown)]
    edge = 1.15 * float(np.quantile(finite, 0.9)) if finite.size and finite.max() > 0.0 else 1.0
    for place, (low, middle, high) in enumerate(shown):
        axes.plot([low, min(high, edge)], [place, place], color=MODEL, lw=1.6)
        if middle <= edge:
            axes.plot([middle], [place], "o", ms=4.0, color=MODEL)
        if high > edge:
            axes.annotate("→", (1.0, place), xycoords=("axes fraction", "data"), va="center", color=MODEL)
    axes.set_yticks(range(len(order)), [str(fleet["machine"].values[k]) for k in order], fontsize=8.0)
    axes.set_xlim(0.0, edge)
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.set_xlabel(f"remaining life [{time_unit}]")
    axes.set_ylabel("machine, most urgent first")
    caption(axes, "median and 90 % interval")
