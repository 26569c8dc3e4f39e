"""``python -m experiments.loop_measured_figures``: the loop on measured records, in figures for the docs."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from experiments.loop_measured import TARGET_RATIO
from experiments.pendulum_forecast import PUBLISHED
from friction_bayes.plotting.style import ACCENT, FAINT, MODEL, caption, new_figure, save_figure, styled

__all__ = ["draw_forecasts", "draw_gains", "draw_residuals", "main"]

_COLUMNS = 4


def draw_gains(dataset: xr.Dataset) -> Figure:
    """Held-out error before and after, a line a record, over the span of its signal."""
    span = np.nanmax(dataset["signal"].values, axis=1) - np.nanmin(dataset["signal"].values, axis=1)
    before = dataset["held_out_before"].values / span
    after = dataset["held_out_after"].values / span
    floor = dataset["noise_floor"].values / span
    figure = new_figure(7.4, 1.6 + 0.22 * before.size)
    axes = figure.add_subplot()
    places = np.arange(before.size)
    for place, x, y in zip(places, before, after, strict=True):
        axes.plot([x, y], [place] * 2, color=FAINT, lw=4.0, zorder=1)
    axes.plot(before, places, "s", color=ACCENT, ms=6.0, label="before: Coulomb alone")
    axes.plot(after, places, "o", color=MODEL, ms=6.5, label="after")
    axes.plot(floor, places, "|", color="#111111", ms=10.0, mew=1.4, label="residual of the final fit")
    axes.set_xscale("log")
    axes.set_yticks(places, dataset["record"].values.tolist())
    axes.set_ylim(before.size - 0.5, -0.5)
    axes.set_xlabel("RMS error over the last 30 %, over the span of the signal")
    ratio = float(np.median(dataset["ratio"]))
    axes.set_title("held out")
    caption(axes, f"median after / before {ratio:.2g} (target {TARGET_RATIO:g})")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def draw_residuals(dataset: xr.Dataset) -> Figure:
    """What the final model leaves of each record."""
    count = dataset.sizes["record"]
    rows = -(-count // _COLUMNS)
    figure = new_figure(11.4, 1.5 * rows)
    panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for k, axes in enumerate(panels):
        if k >= count:
            axes.set_axis_off()
            continue
        case = dataset.isel(record=k)
        time, signal, after = (case[name].dropna("sample").values for name in ("time", "signal", "after"))
        axes.axhline(0.0, color="#999999", lw=0.6)
        axes.plot(time, signal - after, color=MODEL, lw=0.7)
        axes.set_title(case["record"].item(), fontsize=8.0)
        axes.set_ylabel(f"[{case['unit'].item()}]", fontsize=8.0)
        axes.tick_params(labelsize=8.0)
        axes.locator_params(nbins=5)
    return figure


def draw_forecasts(dataset: xr.Dataset, own: str) -> Figure:
    """Angle error of the published law and of ours over the two segments that neither was fitted to."""
    figure = new_figure(8.6, 3.0)
    panels = figure.subplots(1, 2, sharey=True)
    wanted = ((PUBLISHED, ACCENT, "published law"), (own, MODEL, own))
    for axes, segment in zip(panels, dataset["segment"].values.tolist(), strict=True):
        for law, color, label in wanted:
            # of several runs of a law, the one whose noise the residual decided
            case = dataset.isel(case=np.flatnonzero(dataset["law"].values == law)[-1]).sel(segment=segment)
            error = 1e3 * case["error"].dropna("sample").values
            time = np.linspace(0.0, 9.167, error.size)
            axes.plot(
                time, error, color=color, lw=1.0, label=f"{label}: RMS {1e3 * float(case['rms']):.1f} mrad"
            )
        axes.set_title(segment, fontsize=10.0)
        axes.set_xlabel("time [s]")
        axes.legend(loc="lower left", fontsize=8.0)
    panels[0].set_ylabel("error [mrad]")
    return figure


def main() -> None:
    """Draw from the results of ``loop_measured`` and ``pendulum_forecast``."""
    parser = argparse.ArgumentParser(prog="python -m experiments.loop_measured_figures", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument("--out", type=Path, default=Path("docs/figures"), help="(default %(default)s)")
    parser.add_argument("--law", default="the catalogue", help="drawn beside the published one (%(default)s)")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    loaded = {}
    for name in ("loop_measured", "pendulum_forecast"):
        with xr.open_dataset(options.results / f"{name}.nc", engine="h5netcdf") as dataset:
            loaded[name] = dataset.load()
    with styled():
        drawn = {
            "loop_measured_gains": draw_gains(loaded["loop_measured"]),
            "loop_measured_residuals": draw_residuals(loaded["loop_measured"]),
            "pendulum_forecast": draw_forecasts(loaded["pendulum_forecast"], options.law),
        }
    for name, figure in drawn.items():
        save_figure(figure, options.out, name, formats=("png",))


if __name__ == "__main__":
    main()
