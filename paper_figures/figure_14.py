"""Fig. 14: posteriors of the reduced data set at three sampling rates."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, MODEL, TRUTH, PaperFigure, draw_joint, main, new_figure

__all__ = ["FIGURE"]

READINGS = {"highest": ("-", ACCENT), "nominal": ("--", MODEL)}


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One panel a rate."""
    shown = results["shown_records"]
    cases = [case for case in shown["case"].values.tolist() if case.startswith("2-reduced")]
    figure = new_figure(7.0, 7.6)
    panels = figure.subplots(len(cases), 1, sharex=True)
    for axes, case in zip(panels, cases, strict=True):
        mine = shown.sel(case=case)
        for reading, (style, colour) in READINGS.items():
            one = mine.sel(peaks=reading)
            label = f"{reading}: r = {float(one['friction']):.4f} N, s = {float(one['precision']):.3g} 1/N²"
            draw_joint(
                axes, one, "posterior", shade=reading == "nominal", style=style, colour=colour, label=label
            )
        reference = float(mine["reference"].isel(peaks=0))
        axes.axvline(reference, color=TRUTH, lw=1.2, ls=":", label=f"reference {reference:.4f} N")
        axes.set_title(case.split(", ")[1])
        axes.legend(loc="upper left")
        axes.label_outer()
    return figure


FIGURE = PaperFigure(
    name="figure_14",
    results=("shown_records",),
    caption="Fig. 14 of the paper, on synthetic data: posteriors at three sampling rates.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
