"""Fig. 4: precision parameter and friction against the friction samples used."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import FAINT, MODEL, TRUTH, PaperFigure, legend_right, main, new_figure

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Friction above, precision below: one record, and the band of all of them."""
    found = results["data_used"]
    figure = new_figure(8.4, 5.6)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, reading in enumerate(found["peaks"].values.tolist()):
        mine = found.sel(peaks=reading)
        for row, variable in enumerate(("friction", "precision")):
            axes = panels[row, column]
            low, middle, high = np.nanquantile(mine[variable].values, [0.05, 0.5, 0.95], axis=0)
            axes.fill_between(mine["samples"], low, high, color=FAINT, lw=0.0, label="90 % of the records")
            axes.plot(mine["samples"], middle, color=MODEL, label="median")
            one = mine[variable].isel(replicate=0)
            axes.plot(mine["samples"], one, color="#333333", lw=0.8, marker=".", ms=3, label="one record")
        panels[0, column].axhline(found.attrs["friction"], color=TRUTH, ls=":", lw=1.2, label="true friction")
        panels[0, column].set_title(f"{reading} peaks")
        panels[1, column].set_xlabel("friction samples used [number]")
    panels[0, 0].set_ylabel("friction [N]")
    panels[1, 0].set_ylabel("precision [1/N²]")
    panels[1, 0].set_yscale("log")
    for row in range(2):
        legend_right(panels[row, 1])
    return figure


FIGURE = PaperFigure(
    name="figure_04",
    results=("data_used",),
    paper=(
        "precision and friction against the number of data used: the precision parameter is said to be "
        "higher where friction is estimated better."
    ),
    caption=(
        "both settle as friction samples come in, every number of them from 2 on, but in the median "
        "precision starts high and falls: with few samples it is what their chance scatter makes it. Under a "
        "prior whose mean precision is below that of the samples it rises, as in the paper (paper.md, what "
        "depends on the prior). Median and 90 % of 200 records, and one of them; priors are the package's "
        "default, nearly flat, as in the table."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
