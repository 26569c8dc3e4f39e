"""A force that fluctuates: the paper's estimator, criterion and intervals, and the whole-signal fit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.drawing import TRUTH, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

STYLES = {
    "normal-gamma, highest": ("#d55e00", "-.", "^"),
    "normal-gamma, nominal": ("#8a5a83", ":", "v"),
    "waveform, white noise alone": ("#009e73", "--", "s"),
    "waveform, random force": ("#0b4f8a", "-", "o"),
}
TIME = 0.1
"""Correlation time of the forces drawn [s]."""


def _lines(
    axes: Axes, mine: xr.Dataset, values: Mapping[str, np.ndarray], errors: Mapping[str, np.ndarray]
) -> None:
    for k, (method, (colour, style, marker)) in enumerate(STYLES.items()):
        if method in values:
            axes.errorbar(
                100.0 * mine["size"].values + 0.5 * (k - 1.5),
                values[method],
                yerr=errors[method],
                color=colour,
                ls=style,
                marker=marker,
                ms=4.5,
                capsize=2.0,
                label=method,
            )


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One column a noise; RMS error, coverage, and precision over that without the force."""
    found = results["random_force_verdict"]
    noises = sorted(set(found["noise"].values[np.isfinite(found["noise"].values)].tolist()), reverse=True)
    figure = new_figure(8.4, 8.8)
    panels = figure.subplots(3, len(noises), sharex=True, sharey="row", squeeze=False)
    for column, noise in enumerate(noises):
        kept = (found["noise"] == noise) & (found["time"] == TIME)
        mine = found.isel(condition=np.flatnonzero(kept.values))
        n = mine.sizes["replicate"]
        rms, rms_error, covers, covers_error, precision, spread = ({} for _ in range(6))
        for method in STYLES:
            one = mine.sel({"method": method})
            square = one["error"] ** 2
            rms[method] = 100.0 * np.sqrt(square.mean("replicate").values)
            rms_error[method] = (
                100.0 * square.std("replicate").values / np.sqrt(n) / (2.0 * rms[method] / 100.0)
            )
            share = one["covers"].mean("replicate").values
            inner = np.clip(share, 0.5 / n, 1.0 - 0.5 / n)
            covers[method], covers_error[method] = 100.0 * share, 100.0 * np.sqrt(inner * (1.0 - inner) / n)
            if one["precision"].notnull().any():
                ratio = (one["precision"] / one["precision"].isel(condition=0)).quantile(
                    [0.05, 0.5, 0.95], "replicate"
                )
                low, middle, high = ratio.transpose("quantile", "condition").values
                precision[method], spread[method] = middle, np.array([middle - low, high - middle])
        top, middle_panel, bottom = panels[:, column]
        _lines(top, mine, rms, rms_error)
        top.set_yscale("log")
        top.set_title(f"noise of a sample {1e3 * noise:.2g} mm")
        _lines(middle_panel, mine, covers, covers_error)
        middle_panel.axhline(90.0, color=TRUTH, lw=0.8)
        _lines(bottom, mine, precision, spread)
        bottom.axhline(0.9, color=TRUTH, lw=0.8, ls="--", label="least share accepted")
        bottom.set_yscale("log")
        bottom.set_ylim(0.1, 2.2)
        bottom.set_yticks([0.1, 0.2, 0.5, 1.0, 2.0], ["0.1", "0.2", "0.5", "1", "2"])
        bottom.set_yticks([], minor=True)
        bottom.set_xlabel("standard deviation of the force over the friction [%]")
    panels[0, 0].set_ylabel("RMS error of the friction [%]")
    panels[1, 0].set_ylabel("90 % intervals that cover it [%]")
    panels[2, 0].set_ylabel("precision over that\nwithout the force [1]")
    panels[2, 0].legend(loc="lower left", fontsize=8)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


FIGURE = PaperFigure(
    name="random_force_verdict",
    results=("random_force_verdict",),
    caption=(
        "The paper takes whatever departs from Coulomb's law for noise and judges a record by its "
        "precision. Ours: its example with an Ornstein-Uhlenbeck force over 0.1 s, its estimator and the "
        "whole-signal fit; bars are Monte Carlo errors, of the precision 90 % of the records."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
