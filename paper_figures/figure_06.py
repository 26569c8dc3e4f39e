"""Fig. 6: a friction force signal and the Coulomb model."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, PaperFigure, main, new_figure

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
        axes.axvspan(at - 0.04, at + 0.04, color=DATA, alpha=0.25, lw=0.0)
    axes.set_xlim(*SHOWN)
    axes.set_ylim(-0.62, 0.74)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("friction force [N]")
    axes.legend(loc="upper right", ncols=2)
    return figure


FIGURE = PaperFigure(
    name="figure_06",
    results=("shown_records",),
    caption="Fig. 6 of the paper, on synthetic data: friction force and Coulomb model; departures shaded.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
