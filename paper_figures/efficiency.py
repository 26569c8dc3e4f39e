"""RMS error of each estimator against the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import TRUTH, PaperFigure, legend_right, main, new_figure
from paper_figures.methods import METHOD_STYLE

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Errors above, the bound's share of their variance below."""
    found = results["noise_sweep"]
    order = np.argsort(found["snr_db"].values)
    x, bound = found["snr_db"].values[order], found["bound"].values[order]
    figure = new_figure(8.4, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(x, 100.0 * bound, color=TRUTH, lw=1.2, label="Cramér-Rao bound")
    for method in found["method"].values.tolist():
        squares = found["error"].sel({"method": method}) ** 2
        rms = np.sqrt(squares.mean("replicate")).values[order]
        # Monte Carlo error of the mean square, relative
        error = (squares.std("replicate") / squares.mean("replicate")).values[order] / np.sqrt(
            squares.notnull().sum("replicate").values[order]
        )
        above.plot(x, 100.0 * rms, ms=4, label=method, **METHOD_STYLE[method])
        share = (bound / rms) ** 2
        below.errorbar(x, share, yerr=error * share, ms=4, capsize=2, **METHOD_STYLE[method])
    below.axhline(1.0, color=TRUTH, lw=1.2)
    for axes in (above, below):
        axes.set_yscale("log")
    above.set_ylabel("RMS error of friction [%]")
    legend_right(above)
    below.set_ylabel("bound over mean square error [1]")
    below.set_xlabel("signal-to-noise ratio [dB]")
    return figure


FIGURE = PaperFigure(
    name="efficiency",
    results=("noise_sweep",),
    caption=(
        "RMS error of friction on the paper's example, and the Cramér-Rao bound of the same record over "
        "the mean square error, with Monte Carlo errors; 200 records at 21.6, 20, 14.7 and 8.6 dB, 40 "
        "elsewhere. A record has one draw of noise at every level: chance moves all levels together."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
