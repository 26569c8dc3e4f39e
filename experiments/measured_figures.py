"""``python -m experiments.measured_figures``: a figure of every measured record, for the docs."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from friction_bayes.plotting.style import ACCENT, DATA, MODEL, new_figure, save_figure, styled

__all__ = ["draw", "main"]

_HALF_CYCLES_SHOWN = 6.0


def draw(case: xr.Dataset) -> Figure:
    """Signal under its fit, whole and at the end, and what the fit leaves."""
    time, signal, fit, residual = (
        case[name].dropna("sample").values for name in ("time", "signal", "fit", "residual")
    )
    unit = case["signal_unit"].item()
    with styled():
        figure = new_figure(5.8, 3.6)
        panels = figure.subplot_mosaic([["all", "end"], ["left", "left"]], height_ratios=[2.0, 1.0])
        crossings = np.flatnonzero(np.diff(np.signbit(fit - fit.mean())))
        late = crossings[-1 - int(min(_HALF_CYCLES_SHOWN, crossings.size - 1))]
        for name, part in (("all", slice(None)), ("end", slice(late, None))):
            panels[name].plot(time[part], signal[part], color=DATA, lw=0.9)
            panels[name].plot(time[part], fit[part], color=MODEL, lw=0.9, ls="--")
        panels["all"].set_ylabel(f"{case['quantity'].item().replace('_', ' ')} [{unit}]")
        panels["all"].set_title(case["record"].item(), loc="left")
        panels["end"].set_title("its end", loc="left")
        panels["left"].plot(time, residual, color=ACCENT, lw=0.7)
        panels["left"].axhline(0.0, color="#999999", lw=0.6)
        panels["left"].set_ylabel(f"left over [{unit}]")
        panels["left"].set_xlabel("time [s]")
    return figure


def main() -> None:
    """Draw the first method's fit of every record."""
    parser = argparse.ArgumentParser(prog="python -m experiments.measured_figures", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument(
        "--out", type=Path, default=Path("docs/figures/measured"), help="(default %(default)s)"
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with xr.open_dataset(options.results / "measured_estimates.nc", engine="h5netcdf") as dataset:
        dataset.load()
    for k in range(dataset.sizes["case"]):
        case = dataset.isel(case=k)
        if case["method"].item() == dataset["method"].values[0] and not case["refused"].item():
            save_figure(draw(case), options.out, case["record"].item().replace("/", "-"), formats=("png",))


if __name__ == "__main__":
    main()
