"""Fig. 14: posteriors of the reduced data set at three sampling rates."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import (
    ACCENT,
    MODEL,
    TRUTH,
    PaperFigure,
    draw_joint,
    legend_right,
    main,
    new_figure,
)
from paper_figures.joint_figure import DRAWN_PRIOR

__all__ = ["FIGURE"]

READINGS = {"highest": ("-", ACCENT), "nominal": ("--", MODEL)}


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One panel a rate."""
    shown = results["shown_records"]
    cases = [case for case in shown["case"].values.tolist() if case.startswith("2-reduced")]
    figure = new_figure(7.6, 7.6)
    panels = figure.subplots(len(cases), 1, sharex=True)
    for axes, case in zip(panels, cases, strict=True):
        mine = shown.sel(case=case)
        for reading, (style, colour) in READINGS.items():
            one = mine.sel(peaks=reading)
            numbers = f"r = {float(one['friction']):.4f} N\ns = {float(one['precision']):.3g} 1/N²"
            draw_joint(
                axes,
                one,
                "posterior",
                shade=reading == "nominal",
                style=style,
                colour=colour,
                label=f"{reading} peaks\n{numbers}",
            )
        reference = float(mine["reference"].isel(peaks=0))
        axes.axvline(reference, color=TRUTH, lw=1.2, ls=":", label=f"reference\n{reference:.4f} N")
        axes.set_title(case.split(", ")[1])
        legend_right(axes)
        axes.label_outer()
    return figure


FIGURE = PaperFigure(
    name="figure_14",
    results=("shown_records",),
    paper=(
        "posteriors of the reduced data set at 1000, 100 and 10 Hz: the estimate departs farther from the "
        "reference as the rate falls (10.4, 14.4, 20.1 %), precision is lowest at 10 Hz."
    ),
    caption=(
        "one run of the twin, all rates cut from the same record. Precision is lowest at 10 Hz, as in the "
        "paper. The estimates of one run scatter, and need not fall with the rate; over 200 runs the "
        "medians do (table of the sampling rate)." + DRAWN_PRIOR
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
