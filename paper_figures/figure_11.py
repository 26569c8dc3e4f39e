"""Fig. 11: the acquired signal and the reduced data set."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import MODEL, PaperFigure, draw_signal, main, new_figure

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """The whole of data set 2 with its last part marked, and that part enlarged."""
    shown = results["shown_records"]
    whole, part = shown.sel(case="2"), shown.sel(case="2-reduced, 1000 Hz")
    figure = new_figure(7.0, 5.0)
    above, below = figure.subplots(2, 1)
    draw_signal(above, whole)
    draw_signal(above, part, color=MODEL, label="reduced data set")
    above.legend(loc="upper right")
    draw_signal(below, part, color=MODEL, lw=0.8)
    below.set_title("reduced data set")
    return figure


FIGURE = PaperFigure(
    name="figure_11",
    results=("shown_records",),
    caption="Fig. 11 of the paper, on synthetic data: the acquired signal and the reduced data set.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
