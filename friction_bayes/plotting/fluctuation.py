"""The force that a law leaves, as the smoother gives it: over time, and against what it might depend on."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from friction_bayes.core.arrays import Array
from friction_bayes.loop.result import RecordTrace
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, new_figure, styled

__all__ = ["plot_fluctuation"]

_BINS = 24
_BAND = 1.645
"""Standard deviations on either side of a 90 % band."""


def plot_fluctuation(trace: RecordTrace) -> Figure:
    """Draw the random force of a record over time and against velocity, position and amplitude.

    Lines are means in bins, with two standard errors of independent samples; dashed lines are friction.

    Parameters
    ----------
    trace : RecordTrace
        With a random force.

    Returns
    -------
    matplotlib.figure.Figure
    """
    found = trace.fluctuation
    assert found is not None
    amplitude = np.interp(trace.time, trace.turning_times, np.abs(trace.turning_points))
    with styled():
        figure = new_figure(9.0, 6.0)
        grid = figure.add_gridspec(2, 3)
        whole = figure.add_subplot(grid[0, :])
        reach = _BAND * found.sd
        whole.fill_between(trace.time, found.force - reach, found.force + reach, color=FAINT, lw=0.0)
        whole.plot(trace.time, found.force, color=MODEL, lw=0.6, rasterized=True)
        whole.set_xlabel("time [s]")
        whole.set_title(trace.name)
        angular = trace.quantity.startswith("ang")
        length = "rad" if angular else "m"
        for place, values, label in (
            (grid[1, 0], found.velocity, f"velocity [{length}/s]"),
            (grid[1, 1], found.displacement, f"position [{length}]"),
            (grid[1, 2], amplitude, f"amplitude [{length}]"),
        ):
            axes = figure.add_subplot(place)
            axes.plot(values, found.force, ".", color=DATA, ms=1.6, mew=0.0, rasterized=True)
            _draw_means(axes, values, found.force)
            axes.set_xlabel(label)
            axes.locator_params(axis="x", nbins=5)
        for axes in (figure.axes[0], figure.axes[1]):
            axes.set_ylabel(f"force left [{found.unit}]")
        for axes in figure.axes:
            for level in (-found.friction, found.friction):
                axes.axhline(level, color=ACCENT, lw=0.8, ls=(0, (4, 2)))
    return figure


def _draw_means(axes: Axes, values: Array, force: Array) -> None:
    edges = np.linspace(values.min(), values.max(), _BINS + 1)
    which = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    used = count > 2
    mean = np.bincount(which, force, _BINS)[used] / count[used]
    square = np.bincount(which, force**2, _BINS)[used] / count[used]
    error = np.sqrt(np.maximum(square - mean**2, 0.0) / count[used])
    centre = 0.5 * (edges[1:] + edges[:-1])[used]
    axes.errorbar(centre, mean, 2.0 * error, color=MODEL, lw=1.0, elinewidth=0.8)
