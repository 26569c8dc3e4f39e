"""What the figures of the comparison of methods share: one question, three panels over its levels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from paper_figures.drawing import FAINT, TRUTH, PaperFigure, new_figure
from paper_figures.methods import COMPARED_STYLE

__all__ = ["question_figure"]

PANELS = {
    "rms_error": "RMS error [%]",
    "coverage": "covered by 90 %\nintervals [%]",
    "median_width": "their width [%]",
}


def _panel(axes: Axes, at: xr.Dataset, what: str, *, joined: bool) -> None:
    place = np.arange(at.sizes["condition"])
    for k, (method, style) in enumerate(COMPARED_STYLE.items()):
        values = 100.0 * at[what].sel({"method": method}).values
        spread = at.get(f"{what}_se")
        errors = np.zeros_like(values) if spread is None else 100.0 * spread.sel({"method": method}).values
        axes.errorbar(
            place + 0.07 * (k - 0.5 * (len(COMPARED_STYLE) - 1)),
            values,
            yerr=np.nan_to_num(errors),
            elinewidth=1.0,
            label=method,
            **style | ({} if joined else {"ls": "none"}),
        )
    for edge in place[:-1]:
        axes.axvline(edge + 0.5, color=FAINT, lw=0.6, zorder=0)
    if what == "coverage":
        axes.axhline(90.0, color=TRUTH, lw=0.9, ls=":")
        axes.set_ylim(-5.0, 105.0)
    else:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _draw(results: Mapping[str, xr.Dataset], *, question: str, label: str, joined: bool) -> Figure:
    found = results["method_comparison"]
    at = found.isel(condition=found["question"].values == question)
    figure = new_figure(9.0, 7.4)
    panels = figure.subplots(len(PANELS), 1, sharex=True)
    for axes, (what, name) in zip(panels, PANELS.items(), strict=True):
        _panel(axes, at, what, joined=joined)
        axes.set_ylabel(name)
    levels = [str(level) for level in at["level"].values]
    panels[-1].set_xticks(
        range(len(levels)), levels if joined else [level.replace(" ", "\n") for level in levels]
    )
    panels[-1].set_xlabel(label)
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=4)
    return figure


def question_figure(question: str, label: str, caption: str, *, joined: bool = True) -> PaperFigure:
    """Return the figure of one question of the comparison.

    Parameters
    ----------
    question : str
        As in the coordinate ``question`` of its results.
    label : str
        Of the axis of levels.
    caption : str
    joined : bool
        Whether the levels are an ordered scale, whose points are joined by lines.
    """
    draw: Callable[[Mapping[str, xr.Dataset]], Figure] = partial(
        _draw, question=question, label=label, joined=joined
    )
    name = f"methods_{question.replace(' ', '_')}"
    return PaperFigure(name=name, results=("method_comparison",), caption=caption, draw=draw)
