"""Every closed form that was checked against its emcee reference: difference of means, ratio of widths.

Both are shown by the 90 % interval: four amplitudes, as at 10 Hz, leave ``envelope`` Student's t with little
more than two degrees of freedom, whose standard deviation cannot be estimated from draws.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import FAINT, TRUTH, PaperFigure, main, new_figure
from paper_figures.methods import METHOD_STYLE

__all__ = ["FIGURE"]

NORMAL_WIDTH = 3.29
"""Standard deviations in the 90 % interval of a normal distribution."""
EXPERIMENTS = ("noise_sweep", "reduced_data_set", "sampling_rate_sweep")


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One row a method; a mark is one record."""
    figure = new_figure(7.0, 3.8)
    left, right = figure.subplots(1, 2, sharey=True)
    methods = list(METHOD_STYLE)
    for row, method in enumerate(methods):
        style = {"color": METHOD_STYLE[method]["color"], "marker": METHOD_STYLE[method]["marker"]}
        for name in EXPERIMENTS:
            found = results[name]
            if method not in found["method"]:
                continue
            mine = found.sel({"method": method})
            width = mine["high"] - mine["low"]
            shift = ((mine["reference_mean"] - mine["friction"]) / (width / NORMAL_WIDTH)).values.ravel()
            ratio = ((mine["reference_high"] - mine["reference_low"]) / width).values.ravel()
            kept = np.isfinite(shift)
            height = row + 0.5 * (np.arange(kept.sum()) / max(kept.sum() - 1, 1) - 0.5)
            left.scatter(shift[kept], height, s=14, lw=0.8, **style)
            right.scatter(ratio[kept], height, s=14, lw=0.8, **style)
    left.axvline(0.0, color=TRUTH, lw=1.0)
    right.axvline(1.0, color=TRUTH, lw=1.0)
    left.axvspan(-0.03, 0.03, color=FAINT, lw=0.0, zorder=0)
    left.set_yticks(range(len(methods)), methods)
    left.invert_yaxis()
    right.axvspan(0.97, 1.03, color=FAINT, lw=0.0, zorder=0)
    left.set_xlabel("emcee mean - ours\n[90 % width / 3.29]")
    right.set_xlabel("90 % width by emcee\nover ours [1]")
    left.set_title("grey: three Monte Carlo errors of 10 000 draws", fontsize=9, fontweight="normal")
    return figure


FIGURE = PaperFigure(
    name="closed_form_and_sampler",
    results=EXPERIMENTS,
    caption=(
        "Each closed form against emcee by the same likelihood and prior; a mark is one record. Left the "
        "difference of the means, right the ratio of the widths of the 90 % intervals. What lies off the "
        "grey band is waveform on accelerations, whose likelihood jumps with the phase, and envelope at "
        "10 Hz, whose few amplitudes leave a posterior of heavy tails and a larger Monte Carlo error."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
