"""Fig. 6: a friction force signal and the Coulomb model."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, PaperFigure, legend_above, main, new_figure

__all__ = ["FIGURE"]

SHOWN = (3.4, 4.8)
"""The stretch around the departures that the paper names [s]."""
DEPARTURES = (3.8, 4.0, 4.5)


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """The refined load cell and the ideal force."""
    shown = results["shown_records"].sel(case="1")
    figure = new_figure(7.0, 3.4)
    axes = figure.add_subplot()
    axes.plot(shown["time"], shown["force"], color="#7a7a7a", lw=1.4, label="load cell, refined")
    reference = float(shown["reference"].isel(peaks=0))
    axes.plot(
        shown["time"], shown["coulomb"], color=ACCENT, lw=1.0, ls="--", label=f"Coulomb, ±{reference:.4f} N"
    )
    for at in DEPARTURES:
        label = "departures that the paper names" if at == DEPARTURES[0] else None
        axes.axvspan(at - 0.04, at + 0.04, color=DATA, alpha=0.25, lw=0.0, label=label)
    axes.set_xlim(*SHOWN)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("friction force [N]")
    legend_above(axes, 3)
    return figure


FIGURE = PaperFigure(
    name="figure_06",
    results=("shown_records",),
    paper=(
        "a typical friction force signal and the Coulomb model; the difference is larger at about 3.8, 4 "
        "and 4.5 s."
    ),
    caption=(
        "the load cell of the twin, refined by a Savitzky-Golay filter, and Coulomb's force at the "
        "reference. The three departures are put in at the paper's times with sizes of our choice, so "
        "that they agree is no finding."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
