"""The figure of prior above posterior that the paper shows five times: Figs. 2, 8, 10, 12 and 14."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, MODEL, TRUTH, draw_joint, legend_right, new_figure

__all__ = ["DRAWN_PRIOR", "prior_and_posterior"]

DRAWN_PRIOR = (
    " The prior is one that can be drawn: friction centred at 0.5 N and worth a twentieth of a sample, "
    "precision of mean 50 1/N² and worth two samples. The table of single records in experiments.md has "
    "it too; all other tables have the package's default, which is nearly flat, unless they name another."
)
"""Said under each of these figures."""

READINGS = {"highest": ("-", ACCENT), "nominal": ("--", MODEL)}


def prior_and_posterior(shown: xr.Dataset) -> Figure:
    """Draw the prior above, and below it the posterior by either reading of a peak.

    Parameters
    ----------
    shown : xarray.Dataset
        One case of the experiment ``shown_records``.
    """
    figure = new_figure(7.0, 6.0)
    above, below = figure.subplots(2, 1)
    reference = float(shown["reference"].isel(peaks=0))
    draw_joint(above, shown.isel(peaks=0), "prior", truth=reference)
    above.set_title("prior")
    legend_right(above)
    for reading, (style, colour) in READINGS.items():
        one = shown.sel(peaks=reading)
        numbers = f"r = {float(one['friction']):.4f} N\ns = {float(one['precision']):.3g} 1/N²"
        draw_joint(
            below,
            one,
            "posterior",
            shade=reading == "nominal",
            style=style,
            colour=colour,
            label=f"{reading} peaks\n{numbers}",
        )
    below.axvline(reference, color=TRUTH, lw=1.2, ls=":", label=f"reference\n{reference:.4f} N")
    below.set_title("posterior, 90 % regions")
    legend_right(below)
    return figure
