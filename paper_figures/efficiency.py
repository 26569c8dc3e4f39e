"""RMS error of each estimator against the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import TRUTH, PaperFigure, main, new_figure
from paper_figures.methods import METHOD_STYLE

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Errors above, the bound's share of their variance below."""
    found = results["noise_sweep"]
    order = np.argsort(found["snr_db"].values)
    x, bound = found["snr_db"].values[order], found["bound"].values[order]
    figure = new_figure(7.0, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(x, 100.0 * bound, color=TRUTH, lw=1.2, label="Cramér-Rao bound")
    for method in found["method"].values.tolist():
        rms = np.sqrt((found["error"].sel({"method": method}) ** 2).mean("replicate")).values[order]
        above.plot(x, 100.0 * rms, ms=4, label=method, **METHOD_STYLE[method])
        below.plot(x, (bound / rms) ** 2, ms=4, **METHOD_STYLE[method])
    below.axhline(1.0, color=TRUTH, lw=1.2)
    for axes in (above, below):
        axes.set_yscale("log")
    above.set_ylabel("RMS error of friction [%]")
    above.legend(loc="upper right", ncols=2)
    above.set_ylim(top=150.0)
    below.set_ylabel("efficiency")
    below.set_xlabel("signal-to-noise ratio [dB]")
    return figure


FIGURE = PaperFigure(
    name="efficiency",
    results=("noise_sweep",),
    caption="RMS error against the Cramer-Rao bound on the paper's example, synthetic, by noise.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
