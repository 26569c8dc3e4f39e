"""Is the remaining life calibrated, and what does updating without forgetting cost? By law of wear."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, FAINT, MODEL, TRUTH, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

STEPS = ((DATA, ":"), (ACCENT, "--"), (MODEL, "-"))
"""Colour and line, from few points to many."""


def _lag(axes: Axes, found: xr.Dataset) -> None:
    """Error of f(r|Tn) over the machines of each law, both ways, with the most points."""
    most = found.isel(points=-1)
    laws = most["law"].values.tolist()
    for k, (name, colour, label) in enumerate(
        (("forgetting", MODEL, "with forgetting"), ("plain", ACCENT, "nothing forgotten"))
    ):
        error = 100.0 * most[f"{name}_error"]
        low, middle, high = (error.quantile(q, "replicate").values for q in (0.05, 0.5, 0.95))
        place = np.arange(len(laws)) + 0.24 * (k - 0.5)
        axes.errorbar(
            place, middle, yerr=[middle - low, high - middle], fmt="so"[k], color=colour, label=label
        )
    axes.axhline(0.0, color=TRUTH, lw=0.8)
    axes.set_xticks(range(len(laws)), laws)
    axes.set_ylabel("error of the mean of $f(r|T_n)$ [%]")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """The lag above, the distribution of the remaining life's transform for each law below."""
    found = results["monitoring"]
    laws = found["law"].values.tolist()
    figure = new_figure(9.0, 7.4)
    grid = figure.add_gridspec(3, 4, height_ratios=(1.3, 1.0, 1.0))
    _lag(figure.add_subplot(grid[0, :]), found)
    n = found.sizes["replicate"]
    level = np.linspace(0.0, 1.0, 201)
    # Kolmogorov's 95 % band of the distribution function of n uniform values
    reach = 1.36 / np.sqrt(n)
    for i, law in enumerate(laws):
        axes = figure.add_subplot(grid[1 + i // 4, i % 4])
        axes.fill_between(level, level - reach, level + reach, color=FAINT, lw=0.0)
        for points, (colour, line) in zip(found["points"].values.tolist(), STEPS, strict=False):
            pit = np.sort(found["life_pit"].sel(law=law, points=points).values)
            axes.step(pit, (np.arange(n) + 1.0) / n, color=colour, ls=line, where="post", label=f"{points}")
        axes.set_title(law, fontsize=9.0)
        axes.set_xlim(0.0, 1.0)
        axes.set_ylim(0.0, 1.0)
        axes.set_xticks([0.0, 0.5, 1.0])
        axes.set_yticks([0.0, 0.5, 1.0])
        if i % 4 == 0:
            axes.set_ylabel("share of machines")
        if i >= len(laws) - 4:
            axes.set_xlabel("$F(\\Delta t)$ at the true life")
    rest = figure.add_subplot(grid[2, 3])
    rest.set_axis_off()
    rest.legend(*axes.get_legend_handles_labels(), loc="center", title="detection points")
    return figure


FIGURE = PaperFigure(
    name="monitoring",
    results=("monitoring",),
    caption="Updating with and without forgetting, and the remaining life against the truth, synthetic.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
