"""Fig. 11: the acquired signal and the reduced data set."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import MODEL, PaperFigure, draw_signal, legend_above, main, new_figure

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """The whole of data set 2 with its last part marked, and that part enlarged."""
    shown = results["shown_records"]
    whole, part = shown.sel(case="2"), shown.sel(case="2-reduced, 1000 Hz")
    figure = new_figure(7.0, 5.0)
    above, below = figure.subplots(2, 1)
    draw_signal(above, whole)
    draw_signal(above, part, color=MODEL, label="reduced data set")
    legend_above(above, 2)
    draw_signal(below, part, color=MODEL, lw=0.8)
    below.set_title("reduced data set")
    return figure


FIGURE = PaperFigure(
    name="figure_11",
    results=("shown_records",),
    paper=(
        "data set 2 and the short segment at its very end that is taken as the reduced data set, enlarged."
    ),
    caption=("the same on one run of the twin; the segment is the last fifth of the motion."),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
