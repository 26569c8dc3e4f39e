"""Coverage and width of each estimator's 90 % interval against the signal-to-noise ratio."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import FAINT, PaperFigure, legend_right, main, new_figure
from paper_figures.methods import METHOD_STYLE

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Coverage above, width below."""
    found = results["noise_sweep"]
    figure = new_figure(8.4, 6.0)
    above, below = figure.subplots(2, 1, sharex=True)
    records = found["error"].notnull().any("method").sum("replicate")
    spread = 1.645 * np.sqrt(0.9 * 0.1 / records)
    order = np.argsort(found["snr_db"].values)
    x = found["snr_db"].values[order]
    above.fill_between(
        x,
        (90.0 - 100.0 * spread)[order],
        np.minimum(90.0 + 100.0 * spread, 100.0)[order],
        color=FAINT,
        lw=0.0,
        label="90 % give or take chance",
    )
    for method in found["method"].values.tolist():
        mine = found.sel({"method": method})
        above.plot(
            x, 100.0 * mine["covers"].mean("replicate")[order], ms=4, label=method, **METHOD_STYLE[method]
        )
        below.plot(x, 100.0 * mine["width"].median("replicate")[order], ms=4, **METHOD_STYLE[method])
    above.set_ylabel("intervals that cover the truth [%]")
    above.set_ylim(0.0, 108.0)
    legend_right(above)
    below.set_yscale("log")
    below.set_ylabel("width of the interval [% of friction]")
    below.set_xlabel("signal-to-noise ratio [dB]")
    return figure


FIGURE = PaperFigure(
    name="coverage_and_width",
    results=("noise_sweep",),
    caption=(
        "How often the 90 % intervals cover the true friction of the paper's example, and how wide they "
        "are; 200 records at 21.6, 20, 14.7 and 8.6 dB, 40 elsewhere."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
