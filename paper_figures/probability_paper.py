"""Normal probability paper of friction samples, section 3."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, FAINT, MODEL, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

LEVELS = {0.02: -2.054, 0.1: -1.282, 0.5: 0.0, 0.9: 1.282, 0.98: 2.054}
"""Normal quantiles of the shares that are marked."""


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One record's sorted samples, the band of all records, and a normal distribution's straight line."""
    found = results["probability_paper"]
    figure = new_figure(7.0, 3.8)
    panels = figure.subplots(1, found.sizes["peaks"], sharey=True)
    quantile = found["quantile"].values
    for axes, reading in zip(panels, found["peaks"].values.tolist(), strict=True):
        samples = found["samples"].sel(peaks=reading).values
        low, high = np.nanquantile(samples, [0.05, 0.95], axis=0)
        axes.fill_betweenx(quantile, low, high, color=FAINT, lw=0.0, label="90 % of the records")
        first = int(np.flatnonzero(np.isfinite(samples[:, 0]))[0])
        one = samples[first]
        axes.plot(one, quantile, ".", color=MODEL, ms=5, label="one record")
        axes.plot(one.mean() + one.std(ddof=1) * quantile, quantile, color=ACCENT, lw=1.2, label="normal")
        straight = float(found["straightness"].sel(peaks=reading).isel(replicate=first))
        lag = float(found["lag1"].sel(peaks=reading).isel(replicate=first))
        axes.set_title(f"{reading} peaks")
        axes.annotate(
            f"straightness {straight:.3f}\nlag-1 correlation {lag:.2f}",
            (0.97, 0.04),
            xycoords="axes fraction",
            ha="right",
            fontsize=8,
        )
        axes.set_xlabel("friction sample [N]")
        axes.legend(loc="upper left", fontsize=8)
    panels[0].set_yticks(list(LEVELS.values()), [f"{100.0 * share:g} %" for share in LEVELS])
    panels[0].set_ylabel("share of the samples")
    return figure


FIGURE = PaperFigure(
    name="probability_paper",
    results=("probability_paper",),
    caption="Normal probability paper of friction samples, synthetic: straight, and not independent.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
