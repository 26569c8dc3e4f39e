"""What a strong prior does: the paper's precisions at another mass, and friction that comes slowly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from paper_figures.drawing import ACCENT, DATA, MODEL, TRUTH, PaperFigure, main, new_figure

__all__ = ["FIGURE"]

CASES = {
    "1, 1/1": ("set 1", 5.7),
    "2, 1/1": ("set 2", 11.6),
    "2-reduced, 1/1": ("reduced", 32.2),
    "2-reduced, 1/10": ("100 Hz", 32.9),
    "2-reduced, 1/100": ("10 Hz", 27.5),
}
"""Name and the paper's precision [1/N^2] by the end of a condition's name."""
PRIORS = {"next to none": (DATA, "s"), "38 samples, mean 125": (MODEL, "o")}
COLOURS = ("#111111", "#0b4f8a", "#009e73", "#8a5a83", "#d55e00", "#777777")


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Precisions at 19.5 kg with nominal peaks and the paper's, and the friction as samples come in."""
    found = results["prior_sweep"]
    figure = new_figure(9.0, 4.4)
    left, right = figure.subplots(1, 2)
    heavy = [name for name in found["condition"].values.tolist() if " kg, set " in name]
    for k, (prior, (colour, marker)) in enumerate(PRIORS.items()):
        for place, case in enumerate(CASES):
            (name,) = [name for name in heavy if name.endswith(f"set {case}")]
            low, middle, high = (
                found["precision_band"].sel(named=prior, peaks="nominal", condition=name).values
            )
            left.errorbar(
                place + 0.24 * (k - 0.5),
                middle,
                yerr=[[middle - low], [high - middle]],
                color=colour,
                marker=marker,
                capsize=3.0,
                label=f"prior: {prior} 1/N²"
                if k and not place
                else (f"prior: {prior}" if not place else None),
            )
    left.plot(
        range(len(CASES)), [paper for _, paper in CASES.values()], "*", color=ACCENT, ms=11, label="paper"
    )
    left.set_yscale("log")
    left.set_ylim(top=3e3)
    left.set_xticks(range(len(CASES)), [name for name, _ in CASES.values()])
    left.set_xlabel("data set")
    left.set_ylabel("precision s [1/N²]")
    left.set_title("19.5 kg, nominal peaks", fontsize=10)
    left.legend(loc="upper left")
    for colour, weight in zip(COLOURS, found["friction_weight"].values.tolist(), strict=True):
        for reading, style in (("highest", "-"), ("nominal", ":")):
            rms = 100.0 * found["growing_rms"].sel(friction_weight=weight, peaks=reading)
            label = f"{weight:g}" if reading == "highest" else None
            right.plot(found["samples"], rms, color=colour, ls=style, lw=1.4, label=label)
    right.axhline(10.0, color=TRUTH, lw=0.8)
    right.set_xscale("log")
    right.set_yscale("log")
    ticks = [2, 5, 10, 20, 50]
    right.set_xticks(ticks, [str(tick) for tick in ticks])
    right.set_xticks(np.array([]), minor=True)
    right.set_xlabel("friction samples used [number]")
    right.set_ylabel("RMS error of the friction [%]")
    right.set_title("section 3, prior friction 0.5 N", fontsize=10)
    right.legend(loc="lower left", title="worth [samples]", ncols=2)
    return figure


FIGURE = PaperFigure(
    name="prior_strength",
    results=("prior_sweep",),
    caption=(
        "Left, the paper gives five precisions; ours are medians and 90 % bands at 19.5 kg, with next to no "
        "prior and with a strong one. Right, the paper says that a too wide or narrow prior converges very "
        "slowly; ours: RMS error as friction samples come in, full lines highest peaks, dotted nominal."
    ),
    draw=draw,
)

if __name__ == "__main__":
    main([FIGURE])
