"""The force that a law leaves, as the smoother gives it: over time, and against what it might depend on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from friction_bayes.core.arrays import Array, Mask
from friction_bayes.loop.report.result import FluctuationTrace, RecordTrace
from friction_bayes.plotting.motion_units import motion_unit
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, caption, new_figure, styled

__all__ = ["plot_fluctuation"]

_MOST_BINS = 24
_SAMPLES_A_BIN = 12
_LEAST_PASSES = 3
"""Through a bin, for its mean to have a standard error."""
_BAND = 1.645
"""Standard deviations on either side of a 90 % band."""


def plot_fluctuation(trace: RecordTrace, depends_on: str | None = None, shape: str | None = None) -> Figure:
    """Draw the random force of a record over time and against velocity, position and amplitude.

    What depends on the motion does so without the knocks: those are marked over time alone.
    Against position, the two directions of motion have a line each; against amplitude, the part against the
    motion is drawn, which is what friction that depends on the amplitude leaves. Lines are means in bins,
    with two standard errors: of the passes through a bin, as the samples of one pass are not independent.

    Parameters
    ----------
    trace : RecordTrace
        With a random force, or with knocks: of those alone there is nothing to draw against the motion.
    depends_on : str, optional
        ``velocity``, ``position``, ``amplitude`` or ``time``: what the force was found to depend on, which is
        marked.
    shape : str, optional
        That describes it best.

    Returns
    -------
    matplotlib.figure.Figure
    """
    found = trace.fluctuation
    assert found is not None
    steady = np.ones(trace.time.size, dtype=np.bool_)
    for start, end in found.knocks:
        steady &= (trace.time < start) | (trace.time > end)
    with styled():
        figure = new_figure(9.0, 6.4 if found.fluctuates else 3.4)
        grid = figure.add_gridspec(2 if found.fluctuates else 1, 3)
        panels = {"time": figure.add_subplot(grid[0, :])}
        _draw_over_time(panels["time"], trace, found)
        if found.fluctuates:
            below = [figure.add_subplot(grid[1, k]) for k in range(3)]
            panels |= _draw_dependence(below, trace, found, steady)
        said = {} if depends_on is None else {depends_on: f"depends on the {depends_on}"}
        if shape is not None:
            said["time"] = ", ".join([*filter(None, [said.get("time")]), f"most like {shape}"])
        for name, text in said.items():
            # of knocks alone there is a panel over time and no other
            if name in panels:
                caption(panels[name], text)
        handles, labels = panels["time"].get_legend_handles_labels()
        if found.fluctuates:
            more = panels["position"].get_legend_handles_labels()
            handles, labels = handles + more[0], labels + more[1]
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _draw_over_time(axes: Axes, trace: RecordTrace, found: FluctuationTrace) -> None:
    """Draw the force with its band, and mark the knocks."""
    reach = _BAND * found.sd
    axes.fill_between(
        trace.time, found.force - reach, found.force + reach, color=FAINT, lw=0.0, label="its 90 % band"
    )
    axes.plot(trace.time, found.force, color=MODEL, lw=0.6, rasterized=True, label="force left")
    for k, (start, end) in enumerate(found.knocks):
        axes.axvspan(start, end, color=ACCENT, alpha=0.25, lw=0.0, label=None if k else "a knock")
    _draw_friction(axes, found.friction, "± friction")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"force left [{found.unit}]")
    axes.set_title(f"{trace.name}: force left")


def _draw_dependence(
    below: Sequence[Axes], trace: RecordTrace, found: FluctuationTrace, steady: Mask
) -> dict[str, Axes]:
    """Draw it against velocity, position and amplitude, where no knock acts."""
    displacement, velocity, force = (
        values[steady] for values in (found.displacement, found.velocity, found.force)
    )
    amplitude = np.interp(trace.time[steady], trace.turning_times, np.abs(trace.turning_points))
    forward = velocity > 0.0
    against = np.where(forward, -force, force)
    length, speed = (motion_unit(trace.quantity, trace.unit, order) for order in (0, 1))
    panels = dict(zip(("velocity", "position", "amplitude"), below, strict=True))
    for (name, axes), unit, values, shown in zip(
        panels.items(),
        (speed, length, length),
        (velocity, displacement, amplitude),
        (force, force, against),
        strict=True,
    ):
        size = 1.6 if values.size > 2000 else 3.0
        axes.plot(values, shown, ".", color=DATA, ms=size, mew=0.0, rasterized=True)
        axes.set_xlabel(f"{name} [{unit}]")
        axes.locator_params(axis="x", nbins=5)
        _draw_friction(axes, found.friction)
    _draw_means(panels["velocity"], velocity, force, forward)
    _draw_means(panels["amplitude"], amplitude, against, forward)
    for direction, style, label in (
        (True, "-", "mean; of position, forwards"),
        (False, ":", "backwards"),
    ):
        way = forward == direction
        _draw_means(panels["position"], displacement[way], force[way], forward[way], style, label)
    panels["velocity"].set_ylabel(f"force left [{found.unit}]")
    panels["amplitude"].set_ylabel(f"against the motion [{found.unit}]")
    return panels


def _draw_friction(axes: Axes, friction: float, label: str | None = None) -> None:
    """Draw friction in both directions."""
    for level, said in ((-friction, None), (friction, label)):
        axes.axhline(level, color=ACCENT, lw=0.8, ls=(0, (4, 2)), label=said)


def _draw_means(
    axes: Axes, values: Array, force: Array, forward: Mask, style: str = "-", label: str | None = None
) -> None:
    """Draw means in bins, and two standard errors of the passes through each.

    A pass is a run of samples in one bin and in one direction; ``forward`` says which.
    """
    bins = int(np.clip(values.size / _SAMPLES_A_BIN, 4, _MOST_BINS))
    edges = np.linspace(values.min(), values.max(), bins + 1)
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)
    changes = (np.diff(place) != 0) | (np.diff(forward.astype(int)) != 0)
    passing = np.concatenate([[0], np.cumsum(changes)])
    bin_of_pass = place[np.concatenate([[0], np.flatnonzero(changes) + 1])]
    samples, total = np.bincount(passing), np.bincount(passing, force)
    count, passes = np.bincount(place, minlength=bins), np.bincount(bin_of_pass, minlength=bins)
    mean = np.bincount(place, force, bins) / np.maximum(count, 1)
    scatter = np.bincount(bin_of_pass, (total - samples * mean[bin_of_pass]) ** 2, bins)
    error = np.where(passes < _LEAST_PASSES, np.nan, np.sqrt(scatter) / np.maximum(count, 1))
    used, centre = count > 2, 0.5 * (edges[1:] + edges[:-1])
    axes.errorbar(
        centre[used],
        mean[used],
        2.0 * error[used],
        color=MODEL,
        lw=1.2,
        ls=style,
        elinewidth=0.8,
        label=label,
    )
