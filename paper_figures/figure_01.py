"""Fig. 1: condition-based maintenance, followed on a synthetic machine that wears."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, MODEL, TRUTH, PaperFigure, legend_above, main, new_figure

__all__ = ["FIGURE"]

CHAIN = "#009e73"


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """f(r|Ti) standing at each detection point, the threshold, and f(dt|Tn) on the time axis after Tn."""
    found = results["shown_machine"]
    time, mean, sd = (found[name].values for name in ("time", "forgetting_mean", "forgetting_sd"))
    threshold, truth = float(found["threshold"]), found["true_friction"].values
    spacing = float(np.diff(time).mean())
    figure = new_figure(7.6, 4.6)
    axes = figure.add_subplot()
    for i, (at, centre, width) in enumerate(zip(time, mean, sd, strict=True)):
        r = np.linspace(centre - 4.0 * width, centre + 4.0 * width, 121)
        height = 0.75 * spacing * np.exp(-0.5 * ((r - centre) / width) ** 2)
        axes.fill_betweenx(r, at, at + height, color=MODEL, alpha=0.35, lw=0.0)
        axes.plot(at + height, r, color=MODEL, lw=1.0, label="f(r|Ti), forgetting" if i == 0 else None)
        axes.annotate(
            f"T{i + 1}",
            (at, 0.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )
    axes.plot(time, truth, "o", color=TRUTH, ms=4, label="true friction of each record")
    axes.errorbar(
        time,
        found["plain_mean"],
        1.645 * found["plain_sd"],
        color="#777777",
        ls=":",
        capsize=2,
        lw=1.2,
        label="whole signal, posterior becomes prior",
    )
    axes.errorbar(
        time,
        found["chain_mean"],
        1.645 * found["chain_sd"],
        color=CHAIN,
        ls="-.",
        marker="^",
        ms=4,
        capsize=2,
        lw=1.2,
        label="the paper's chain, normal-gamma",
    )
    axes.axhline(threshold, color=ACCENT, ls="--", label="threshold")
    ahead, reached = found["ahead"].values, found["reached"].values
    density = np.gradient(reached, ahead)
    base = threshold
    top = base + 0.25 * (threshold - truth[0]) * density / density.max()
    axes.fill_between(time[-1] + ahead, base, top, color=ACCENT, alpha=0.35, lw=0.0, label="f(Δt|Tn)")
    low, middle, high = found["life"].values
    axes.plot(time[-1] + np.array([low, high]), [base, base], color=ACCENT, lw=4.0, alpha=0.8)
    axes.plot(time[-1] + float(found["true_life"]), base, "*", color=TRUTH, ms=11, label="true end of life")
    axes.axvline(time[-1], color=DATA, lw=0.8)
    axes.set_xlim(-0.1 * time[-1], time[-1] + ahead[-1])
    lowest = float((found["chain_mean"] - 1.645 * found["chain_sd"]).min())
    axes.set_ylim(lowest - 0.1 * threshold, 1.2 * threshold)
    axes.set_xlabel(f"time [h]; remaining life at Tn {middle:.0f} h, 90 % interval {low:.0f} to {high:.0f} h")
    axes.set_ylabel("friction force r [N]")
    legend_above(axes, 2)
    return figure


FIGURE = PaperFigure(
    name="figure_01",
    results=("shown_machine",),
    paper=(
        "a diagram without data: the density f(r|Ti) of the friction at detection points T1 to Tn, a "
        "threshold, and the density f(Δt|Tn) of the remaining life; the posterior at one point is the "
        "prior of the next."
    ),
    caption=(
        "a synthetic machine whose friction grows. Densities of friction with forgetting; mean and 90 % "
        "interval where nothing is forgotten, by the whole signal and by the paper's own chain (normal-gamma "
        "on highest peaks, from the prior of our other figures); the threshold, and the remaining life at "
        "the last point with its 90 % interval (bar)."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
