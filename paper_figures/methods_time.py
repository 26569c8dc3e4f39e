"""Time of each method on the base record, and its error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from paper_figures.drawing import PaperFigure, main, new_figure
from paper_figures.methods import COMPARED_STYLE

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Error against time, one marker a method."""
    base = results["method_comparison"].sel(condition="effect: none")
    figure = new_figure(7.0, 4.4)
    axes = figure.add_subplot()
    for method, style in (COMPARED_STYLE | {"emcee": {"color": "#111111", "marker": "*"}}).items():
        one = base.sel({"method": method})
        milliseconds, error = 1e3 * float(one["median_elapsed"]), 100.0 * float(one["rms_error"])
        records = int(np.isfinite(one["error"]).sum())
        label = method if records == base.sizes["replicate"] else f"{method}, {records} records"
        spread = np.nan_to_num(100.0 * float(one["rms_error_se"]))
        axes.errorbar([milliseconds], [error], yerr=[spread], ms=7.0, **style | {"ls": "none"}, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("time from record to interval [ms]")
    axes.set_ylabel("RMS error of friction [%]")
    figure.legend(loc="outside right center")
    return figure


FIGURE = PaperFigure(
    name="methods_time",
    results=("method_comparison",),
    caption="Time and error of all methods on the base record of the comparison, synthetic.",
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
