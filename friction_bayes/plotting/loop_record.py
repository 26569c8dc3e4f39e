"""Figures of one record of a closed loop: signal, residual and turning points, before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from friction_bayes.core.arrays import Array, Indices, Mask
from friction_bayes.core.text import words
from friction_bayes.loop.report.result import RecordTrace
from friction_bayes.plotting.motion_units import motion_unit
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, caption, new_figure, styled

__all__ = ["draw_signal", "plot_loop_force", "plot_loop_residual", "plot_loop_signal", "plot_turning_points"]

_CLOSE_CYCLES = 3.0
_PHASE_BINS = 24
_AMPLITUDE_BINS = 12
_THIRDS = {"first": "#8ec1e8", "middle": "#3a87c4", "last": "#062d52"}


def _label(trace: RecordTrace) -> str:
    return f"{words(trace.quantity)} [{trace.unit}]"


def _draw_models(axes: Axes, trace: RecordTrace, chosen: Mask, *, marker: str = "") -> None:
    """Record in grey, the Coulomb model dashed, the final model as a line; clipped samples as crosses."""
    time = trace.time[chosen]
    style = {"ls": "", "marker": marker, "ms": 3.0, "mew": 0.0} if marker else {"lw": 0.8}
    axes.plot(time, trace.signal[chosen], color=DATA, rasterized=True, label="record", **style)
    axes.plot(time, trace.before[chosen], color=ACCENT, lw=1.1, ls=(0, (4, 2)), label="before")
    axes.plot(time, trace.after[chosen], color=MODEL, lw=1.0, label="after")
    clipped = chosen & (trace.sides != 0.0)
    if clipped.any() and marker:
        axes.plot(trace.time[clipped], trace.signal[clipped], "x", color="black", ms=3.0, label="clipped")


def draw_signal(axes: Axes, trace: RecordTrace) -> None:
    """Draw the whole record under both models into some axes."""
    _draw_models(axes, trace, np.ones(trace.time.size, dtype=bool))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(_label(trace))


def plot_loop_signal(trace: RecordTrace) -> Figure:
    """Draw the record with the Coulomb model alone (before) and the final one (after), its ends close by.

    Parameters
    ----------
    trace : RecordTrace

    Returns
    -------
    matplotlib.figure.Figure
    """
    turns = trace.turning_times
    period = 2.0 * float(np.median(np.diff(turns))) if turns.size > 1 else float(np.ptp(trace.time))
    reach = min(_CLOSE_CYCLES * period, float(np.ptp(trace.time)) / 3.0)
    stop = turns[-1] + 0.5 * period if turns.size else trace.time[-1]
    with styled():
        figure = new_figure(9.0, 5.0)
        grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0))
        whole = figure.add_subplot(grid[0, :])
        draw_signal(whole, trace)
        whole.set_title(trace.name)
        whole.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
        for place, start, text in (
            (grid[1, 0], trace.time[0], "its first cycles"),
            (grid[1, 1], max(stop - reach, trace.time[0]), "its last cycles"),
        ):
            axes = figure.add_subplot(place)
            chosen = (trace.time >= start) & (trace.time <= start + reach)
            _draw_models(axes, trace, chosen, marker="o")
            axes.set_xlabel("time [s]")
            axes.locator_params(axis="x", nbins=6)
            caption(axes, text)
            whole.axvspan(start, min(start + reach, trace.time[-1]), color=FAINT, alpha=0.5, lw=0.0)
        figure.axes[1].set_ylabel(_label(trace))
    return figure


def plot_loop_residual(trace: RecordTrace) -> Figure:
    """Draw the residual before and after against time, against phase and against amplitude.

    Left the Coulomb model alone, right the final one, each on its own scale. Lines: the mean in bins of the
    phase for each third of the record, as an amplitude misfit changes sign on the way, and the root mean
    square in bins of the amplitude.

    Parameters
    ----------
    trace : RecordTrace

    Returns
    -------
    matplotlib.figure.Figure
    """
    turns, points = trace.turning_times, trace.turning_points
    free = trace.sides == 0.0
    moving = free & (trace.time >= turns[0]) & (trace.time <= turns[-1]) if turns.size > 1 else free
    # the positive turning point is at 0 degrees, whichever comes first
    shift = 1.0 if points.size and points[0] < 0.0 else 0.0
    angle = 180.0 * np.mod(trace.phase[moving] + shift, 2.0)
    amplitude = np.interp(trace.time[moving], turns, np.abs(points)) if turns.size else angle
    with styled():
        figure = new_figure(9.0, 7.0)
        panels = figure.subplots(3, 2)
        for column, name, model in ((0, "before", trace.before), (1, "after", trace.after)):
            residual = trace.signal - model
            over_time, over_phase, over_amplitude = panels[:, column]
            over_time.plot(
                trace.time[free], residual[free], ".", color=DATA, ms=1.6, mew=0.0, rasterized=True
            )
            over_time.set_title(name)
            over_time.set_xlabel("time [s]")
            _scatter(over_phase, angle, residual[moving])
            _phase_means(over_phase, trace.time[moving], angle, residual[moving])
            over_phase.set_xlabel("phase [deg], 0 at the positive turning points")
            over_phase.set_xticks([0, 90, 180, 270, 360])
            _scatter(over_amplitude, amplitude, residual[moving])
            _amplitude_spread(over_amplitude, amplitude, residual[moving])
            over_amplitude.locator_params(axis="x", nbins=6)
            over_amplitude.set_xlabel(f"amplitude [{motion_unit(trace.quantity, trace.unit, 0)}]")
            low, high = np.quantile(residual[free], [0.001, 0.999])
            reach = 1.2 * max(abs(low), abs(high), 1e-300)
            for axes in panels[:, column]:
                axes.axhline(0.0, color="#444444", lw=0.6, zorder=1.5)
                axes.set_ylim(-reach, reach)
        for axes in panels[:, 0]:
            axes.set_ylabel(f"residual [{trace.unit}]")
        lines, labels = panels[1, 1].get_legend_handles_labels()
        spread = Line2D([], [], color=MODEL, lw=1.8)
        figure.legend([*lines, spread], [*labels, "± RMS"], loc="outside lower center", ncols=4)
        figure.suptitle(f"{trace.name}: residual", fontweight="bold", x=0.01, ha="left", fontsize=11.0)
    return figure


def _scatter(axes: Axes, x: Array, residual: Array) -> None:
    axes.plot(x, residual, ".", color=DATA, ms=1.6, mew=0.0, alpha=0.6, rasterized=True)


def _bins(x: Array, edges: Array) -> tuple[Indices, Array]:
    """Bin of each value, and how many there are in each."""
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    return place, np.bincount(place, minlength=edges.size - 1).astype(float)


def _phase_means(axes: Axes, time: Array, angle: Array, residual: Array) -> None:
    edges = np.linspace(0.0, 360.0, _PHASE_BINS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    third = np.linspace(time[0], time[-1], 4) if time.size else np.zeros(4)
    for k, (name, color) in enumerate(_THIRDS.items()):
        chosen = (time >= third[k]) & (time <= third[k + 1])
        place, count = _bins(angle[chosen], edges)
        filled = count > 2
        mean = np.bincount(place, residual[chosen], edges.size - 1)[filled] / count[filled]
        axes.plot(middle[filled], mean, color=color, lw=1.6, label=f"mean, {name} third")


def _amplitude_spread(axes: Axes, amplitude: Array, residual: Array) -> None:
    if np.ptp(amplitude) == 0.0:
        return
    edges = np.linspace(amplitude.min(), amplitude.max(), _AMPLITUDE_BINS + 1)
    place, count = _bins(amplitude, edges)
    filled = count > 2
    rms = np.sqrt(np.bincount(place, residual**2, edges.size - 1)[filled] / count[filled])
    middle = (0.5 * (edges[1:] + edges[:-1]))[filled]
    for sign in (1.0, -1.0):
        axes.plot(middle, sign * rms, color=MODEL, lw=1.8)


def plot_turning_points(trace: RecordTrace) -> Figure:
    """Draw the amplitude over time, and what each half cycle takes from it, by record and both models.

    The record's amplitude at a turning point is the final model's, scaled to fit the samples of the half
    cycle around it; so it is had from any quantity. Dry friction alone takes the same from every half cycle.

    Parameters
    ----------
    trace : RecordTrace

    Returns
    -------
    matplotlib.figure.Figure
    """
    unit = motion_unit(trace.quantity, trace.unit, 0)
    after = np.abs(trace.turning_points)
    before = np.abs(trace.turning_points_before)
    kept, measured = _measured_amplitudes(trace)
    with styled():
        figure = new_figure(9.0, 3.9)
        left, right = figure.subplots(1, 2)
        left.plot(trace.turning_times[kept], measured, "o", ms=4.0, color=DATA, mew=0.0, label="record")
        left.plot(trace.turning_times_before, before, color=ACCENT, lw=1.4, ls=(0, (4, 2)), label="before")
        left.plot(trace.turning_times, after, color=MODEL, lw=1.4, label="after")
        left.set_xlabel("time [s]")
        left.set_ylabel(f"amplitude [{unit}]")
        figure.suptitle(f"{trace.name}: turning points", fontweight="bold", x=0.01, ha="left", fontsize=11.0)
        left.set_ylim(bottom=0.0)
        left.legend(loc="lower left")
        following = np.diff(kept) == 1
        lost = -np.diff(measured)[following]
        middle = (0.5 * (measured[1:] + measured[:-1]))[following]
        right.plot(middle, lost, "o", ms=3.5, color=DATA, mew=0.0)
        for points, color, style in ((before, ACCENT, (0, (4, 2))), (after, MODEL, "-")):
            right.plot(0.5 * (points[1:] + points[:-1]), -np.diff(points), color=color, lw=1.6, ls=style)
        right.set_xlabel(f"amplitude [{unit}]")
        right.set_ylabel(f"lost in a half cycle [{unit}]")
        caption(right, "dry friction alone: the same for all")
        if lost.size:
            low, high = np.quantile(lost, [0.02, 0.98])
            drops = np.concatenate([-np.diff(before), -np.diff(after)])
            low, high = min(low, float(drops.min())), max(high, float(drops.max()))
            margin = 0.2 * (high - low)
            right.set_ylim(min(0.0, low - margin), high + margin)
    return figure


def _measured_amplitudes(trace: RecordTrace) -> tuple[Indices, Array]:
    """Turning points that have samples around them, and the record's amplitude there."""
    count = trace.turning_points.size
    if count == 0:
        return np.empty(0, dtype=np.intp), np.empty(0)
    inside = (trace.sides == 0.0) & (trace.time >= trace.turning_times[0])
    inside &= trace.time <= trace.turning_times[-1]
    place = np.clip(np.rint(trace.phase[inside]).astype(int), 0, count - 1)
    model, signal = trace.after[inside], trace.signal[inside]
    power = np.bincount(place, model * model, count)
    enough = (np.bincount(place, minlength=count) >= 3) & (power > 0.0)
    scale = np.bincount(place, model * signal, count)[enough] / power[enough]
    return np.flatnonzero(enough), scale * np.abs(trace.turning_points)[enough]


def plot_loop_force(trace: RecordTrace, *, unit: str) -> Figure:
    """Draw a measured friction force with both models: over the first cycles, and its level over the record.

    The level is the force against the motion; plain dry friction keeps it constant.

    Parameters
    ----------
    trace : RecordTrace
        With ``forces``.
    unit : str
        Unit of force.

    Returns
    -------
    matplotlib.figure.Figure
    """
    assert trace.forces is not None
    # a force that fluctuates may push for a while
    against = np.sign(trace.forces[2] if trace.fluctuation is None else trace.fluctuation.velocity)
    styles = (
        ("measured", {"color": DATA, "ls": "", "marker": ".", "ms": 3.5, "mew": 0.0}),
        ("before", {"color": ACCENT, "lw": 1.2, "ls": (0, (4, 2))}),
        ("after", {"color": MODEL, "lw": 1.2}),
    )
    turns = trace.turning_times
    period = 2.0 * float(np.median(np.diff(turns))) if turns.size > 1 else float(np.ptp(trace.time))
    early = trace.time <= trace.time[0] + _CLOSE_CYCLES * period
    with styled():
        figure = new_figure(9.0, 3.6)
        left, right = figure.subplots(1, 2)
        for (name, style), force in zip(styles, trace.forces, strict=True):
            left.plot(trace.time[early], force[early], label=name, rasterized=True, **style)
            right.plot(trace.time, force * against, rasterized=True, **style)
        left.set_title(f"{trace.name}: friction force")
        left.legend(loc="upper right", ncols=3)
        left.set_ylabel(f"resisting force [{unit}]")
        caption(right, "against the motion")
        for axes in (left, right):
            axes.set_xlabel("time [s]")
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.15 * (high - low))
    return figure
