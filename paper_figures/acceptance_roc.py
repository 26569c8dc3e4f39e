"""Receiver operating characteristics of five acceptance criteria."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import DATA, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

STYLES = {
    "precision": ("#d55e00", "-", 2.4),
    "interval width": ("#0b4f8a", "-", 1.6),
    "evidence": ("#009e73", "--", 1.6),
    "residual test": ("#777777", ":", 1.8),
    "whole-signal width": ("#111111", "-.", 1.6),
}


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """One panel a reading of a peak."""
    found = results["acceptance_roc"]
    methods = found["method"].values.tolist()
    figure = new_figure(7.4, 5.8)
    for axes, method in zip(figure.subplots(1, len(methods), sharey=True), methods, strict=True):
        mine = found.sel({"method": method})
        ranked = sorted(
            mine["criterion"].values.tolist(), key=lambda name: -float(mine["area"].sel(criterion=name))
        )
        for criterion in ranked:
            colour, style, width = STYLES[criterion]
            area = float(mine["area"].sel(criterion=criterion))
            axes.plot(
                mine["false_rate"],
                mine["true_rate"].sel(criterion=criterion),
                color=colour,
                ls=style,
                lw=width,
                label=f"{criterion}, {area:.2f}",
            )
        axes.plot([0, 1], [0, 1], color=DATA, lw=0.8)
        axes.set_title(method)
        axes.set_xlabel("bad estimates accepted [share]")
        axes.set_aspect("equal")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), title="criterion, area")
        axes.label_outer()
    figure.axes[0].set_ylabel("good estimates accepted [share]")
    return figure


FIGURE = PaperFigure(
    name="acceptance_roc",
    results=("acceptance_roc",),
    caption=(
        "Share of good (within 10 %) and of bad estimates that a criterion accepts as its threshold "
        "moves, for the paper's precision and four others; records of 24 conditions. Priors are the "
        "package's default, but for the evidence, which has none under it: the prior as drawn."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
