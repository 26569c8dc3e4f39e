"""The figure of an acquired and an estimated response that the paper shows twice: Figs. 7 and 9."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import MODEL, draw_signal, legend_above, new_figure

__all__ = ["acquired_and_estimated"]

CLOSE_UP = 0.75
"""Length of the lower panel [s]: some two periods, where the jumps at the turning points can be seen."""


def acquired_and_estimated(shown: xr.Dataset) -> Figure:
    """Draw the whole decay above and two periods of it below.

    Parameters
    ----------
    shown : xarray.Dataset
        One case of the experiment ``shown_records``.
    """
    figure = new_figure(7.0, 5.0)
    whole, close = figure.subplots(2, 1)
    time = shown["time"].values
    friction = float(shown["friction"].sel(peaks="highest"))
    moving = np.flatnonzero(np.nan_to_num(shown["estimated"].values) != 0.0)
    middle = 0.5 * time[moving[-1]]
    for axes in (whole, close):
        draw_signal(axes, shown, lw=2.4, color="#b5b5b5")
        axes.plot(time, shown["estimated"], color=MODEL, lw=0.9, label=f"response of r = {friction:.4f} N")
    whole.set_xlim(0.0, 1.05 * time[moving[-1]])
    legend_above(whole, 2)
    close.set_xlim(middle, middle + CLOSE_UP)
    seen = shown["signal"].values[(time > middle) & (time < middle + CLOSE_UP)]
    close.set_ylim(1.15 * seen.min(), 1.15 * seen.max())
    close.set_title("two periods of it")
    return figure
