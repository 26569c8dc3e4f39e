"""Fig. 13: the reduced data set at three sampling rates."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import MODEL, PaperFigure, draw_signal, main, new_figure

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One panel a rate, samples marked where they are far enough apart."""
    shown = results["shown_records"]
    cases = [case for case in shown["case"].values.tolist() if case.startswith("2-reduced")]
    figure = new_figure(7.0, 6.0)
    panels = figure.subplots(len(cases), 1, sharex=True, sharey=True)
    for axes, case in zip(panels, cases, strict=True):
        coarse = "1000" not in case
        draw_signal(
            axes,
            shown.sel(case=case),
            color=MODEL,
            lw=0.8,
            marker="o" if coarse else "",
            ms=4.0 if "10 " in case else 2.0,
        )
        axes.set_title(case.split(", ")[1])
        axes.label_outer()
    return figure


FIGURE = PaperFigure(
    name="figure_13",
    results=("shown_records",),
    paper=("the reduced data set at 1000, 100 and 10 Hz."),
    caption=(
        "the same on one run of the twin. At 10 Hz some three samples a period are left, and the highest "
        "of them misses the peak."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
