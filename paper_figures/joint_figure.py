"""The figure of prior above posterior that the paper shows five times: Figs. 2, 8, 10, 12 and 14."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, MODEL, draw_joint, new_figure

__all__ = ["prior_and_posterior"]

READINGS = {"highest": ("-", ACCENT), "nominal": ("--", MODEL)}


def prior_and_posterior(shown: xr.Dataset) -> Figure:
    """Draw the prior above, and below it the posterior by either reading of a peak.

    Parameters
    ----------
    shown : xarray.Dataset
        One case of the experiment ``shown_records``.
    """
    figure = new_figure(5.2, 6.0)
    above, below = figure.subplots(2, 1)
    reference = float(shown["reference"].isel(peaks=0))
    draw_joint(above, shown.isel(peaks=0), "prior", truth=reference)
    above.set_title("prior")
    above.legend(loc="upper right")
    for reading, (style, colour) in READINGS.items():
        one = shown.sel(peaks=reading)
        label = f"{reading} peaks: r = {float(one['friction']):.4f} N, s = {float(one['precision']):.3g} 1/N²"
        draw_joint(
            below, one, "posterior", shade=reading == "nominal", style=style, colour=colour, label=label
        )
    below.axvline(reference, color="#111111", lw=1.2, ls=":", label=f"reference {reference:.4f} N")
    below.set_title("posterior, 90 % regions")
    below.set_ylim(top=1.45 * below.get_ylim()[1])
    below.legend(loc="upper right")
    return figure
