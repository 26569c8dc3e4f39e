"""The paper's errors traced: without each fault of measuring, and with it in the model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from friction_bayes.plotting.style import caption
from paper_figures.drawing import ACCENT, FAINT, MODEL, TRUTH, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

PAPER = {1000.0: -10.4, 100.0: -14.4, 10.0: -20.1}
"""Errors of Table 2 [%], by sampling rate [Hz]; its estimates lie below the reference."""


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One panel a rate: median and 90 % of the records, a row a step."""
    found = results["residuals_traced"]
    steps = found["step"].values.tolist()
    figure = new_figure(8.4, 4.2)
    panels = figure.subplots(1, len(PAPER), sharey=True)
    for axes, (rate, paper) in zip(panels, PAPER.items(), strict=True):
        error = 100.0 * found["error"].sel(sampling_rate=rate)
        for row, step in enumerate(steps):
            values = error.sel(step=step).values
            values = values[np.isfinite(values)]
            colour = TRUTH if row == 0 else (MODEL if row >= 4 else "#777777")
            if values.size < 20:
                axes.annotate(
                    "mostly refused", (0.0, row), ha="center", va="center", fontsize=8, color="#555555"
                )
                continue
            low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
            axes.plot([low, high], [row, row], color=colour, lw=3.0, alpha=0.55)
            axes.plot(middle, row, "o", color=colour, ms=5)
        axes.axvline(0.0, color=TRUTH, lw=0.8)
        axes.axvline(paper, color=ACCENT, lw=1.4, ls="--")
        axes.axhspan(0.5, 3.5, color=FAINT, alpha=0.5, lw=0.0, zorder=0)
        axes.set_title(f"{rate:g} Hz")
        caption(axes, f"paper {paper:g} %")
        axes.set_xlim(-45.0, 30.0)
        axes.set_xlabel("error [%]")
    panels[0].set_yticks(range(len(steps)), steps)
    panels[0].invert_yaxis()
    return figure


FIGURE = PaperFigure(
    name="residuals_traced",
    results=("residuals_traced",),
    caption="Errors on the reduced data set: a fault of measuring taken away (shaded) or modelled.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
