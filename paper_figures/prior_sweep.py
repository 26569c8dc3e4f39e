"""Claims of the paper over the weight and the mean of the prior's precision, by either reading of a peak."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import TRUTH, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

FRICTION, WEIGHT = 0.5, 0.05
"""Prior of the friction under which the claims are drawn [N], and its weight [samples]."""
PANELS = {
    "Fig. 4: precision and |error| as data come in": ("rank correlation [1]\nFig. 4: negative", 0.0, False),
    "Table 2: precision falls from 1 kHz to 10 Hz": (
        "share of the runs [1]\nTable 2: falls to 10 Hz",
        0.5,
        True,
    ),
    "Table 2: precisions at 100 Hz and 1 kHz within 10 %": (
        "share of the runs [1]\n100 Hz as 1 kHz",
        0.5,
        True,
    ),
    "acceptance within 10 %: area, precision": ("area under the curve [1]\naccepts within 10 %", 0.5, True),
}
"""Label of each claim's axis, what it has to exceed or stay under, and which of the two."""
COLOURS = ("#111111", "#0b4f8a", "#009e73", "#d55e00", "#8a5a83")
MARKERS = "osD^v"


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One row a claim, one column a reading; grey: the claim holds; dashed: the interval's own width."""
    found = results["prior_sweep"]
    shown = found.isel(prior=np.flatnonzero((found["mu"] == FRICTION) & (found["lam"] == WEIGHT)))
    # the priors with a name are no part of the grid
    shown = shown.isel(prior=[str(name).startswith("grid") for name in shown["prior"].values])
    weight, mean = 2.0 * shown["alpha"].values, (shown["alpha"] / shown["beta"]).values
    figure = new_figure(8.4, 10.4)
    panels = figure.subplots(len(PANELS), 2, sharex=True, sharey="row")
    for row, (claim, (label, least, above)) in enumerate(PANELS.items()):
        for column, reading in enumerate(("highest", "nominal")):
            axes = panels[row, column]
            mine = shown.sel(claim=claim, peaks=reading)
            low = -1.05 if least == 0.0 else -0.05
            axes.set_ylim(low, 1.05)
            axes.axhspan(least if above else low, 1.05 if above else least, color="#ececec", lw=0.0, zorder=0)
            axes.axhline(least, color=TRUTH, lw=0.8)
            for k, level in enumerate(np.unique(mean)):
                one = mean == level
                axes.errorbar(
                    weight[one],
                    mine["value"].values[one],
                    yerr=1.645 * mine["monte_carlo_error"].values[one],
                    color=COLOURS[k],
                    marker=MARKERS[k],
                    ms=4.0,
                    lw=1.2,
                    capsize=2.0,
                    label=f"{level:g}",
                )
                if "area" in claim:
                    width = shown.sel(
                        claim=claim.replace("precision", "width of the interval"), peaks=reading
                    )
                    axes.plot(weight[one], width["value"].values[one], color=COLOURS[k], ls="--", lw=0.9)
            axes.set_xscale("log")
            axes.set_xticks(np.unique(weight), [f"{each:g}" for each in np.unique(weight)])
            axes.set_xticks([], minor=True)
            if row == 0:
                axes.set_title(f"{reading} peaks")
        panels[row, 0].set_ylabel(label)
    for axes in panels[-1]:
        axes.set_xlabel("weight of the prior's precision, 2α [samples]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside upper center",
        ncols=len(labels),
        title="prior mean of the precision [1/N²]",
    )
    return figure


FIGURE = PaperFigure(
    name="prior_sweep",
    results=("prior_sweep",),
    caption=(
        "The paper shows one prior a case, as a picture. Ours: four of its claims under thirty priors, "
        "friction 0.5 N worth a twentieth of a sample; grey where a claim holds, bars 90 % of the Monte "
        "Carlo error, dashed the area of the interval's width."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
