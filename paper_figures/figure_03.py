"""Fig. 3: prior and posterior of the gamma-exponential pair, which converges to 1/r."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, MODEL, TRUTH, PaperFigure, legend_right, main, new_figure

__all__ = ["FIGURE"]


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Prior above, posterior below, each with the true friction and what it converges to."""
    shown = results["shown_records"]
    truth = float(shown["reference"].sel(case="example").isel(peaks=0))
    mean, low, high = shown["rate"].values
    figure = new_figure(7.6, 5.0)
    panels = figure.subplots(2, 1)
    for axes, stage in zip(panels, ("prior", "posterior"), strict=True):
        axis, density = shown[f"rate_{stage}"].values, shown[f"rate_{stage}_pdf"].values
        axes.plot(axis, density, color=MODEL)
        axes.axvline(truth, color=ACCENT, lw=1.6, label=f"true friction\n{truth:g} N")
        axes.set_title(stage)
        axes.set_xlabel("what the pair calls friction: a rate by its equations [1/N]")
        axes.set_ylabel("density [N]")
        axes.set_ylim(bottom=0.0)
    panels[1].fill_between(axis, density, where=(axis >= low) & (axis <= high), color=DATA, alpha=0.4, lw=0.0)
    panels[1].axvline(
        mean, color="#555555", ls="--", label=f"estimate {mean:.3g} 1/N\n90 %: {low:.3g} to {high:.3g}"
    )
    panels[1].axvline(1.0 / truth, color=TRUTH, ls=":", label=f"1 / true friction\n{1.0 / truth:.3g} 1/N")
    for axes in panels:
        legend_right(axes)
    return figure


FIGURE = PaperFigure(
    name="figure_03",
    results=("shown_records",),
    paper=(
        "prior and posterior by the gamma-exponential pair on the same data; the posterior is narrow and "
        "far from the true value."
    ),
    caption=(
        "the same, and why: the pair's parameter is a rate, and its posterior settles at one over the "
        "friction (dotted), not at the friction (orange, in N on an axis of 1/N). The prior is worth one "
        "sample of 0.2 N. One record, highest samples."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
