"""``python -m experiments.loop_calibration_figures``: ranks and probabilities of the loop, for the docs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from scipy import stats

from experiments.figures import figure_parser, load_results
from experiments.loop_calibration import judged, rank_test, reliability
from friction_bayes.plotting.style import ACCENT, FAINT, MODEL, TRUTH, new_figure, save_figure, styled

__all__ = ["draw_ranks", "draw_reliability", "main"]


def draw_ranks(axes: Axes, dataset: xr.Dataset) -> None:
    """Distribution function of the places of the truth, less a uniform one, and its simultaneous band."""
    records, test = judged(dataset), rank_test(dataset)
    (level,) = {check.level for check in test.checks}
    reach = float(stats.kstwo.ppf(1.0 - level, test.pit.size))
    axes.fill_between((0.0, 1.0), -reach, reach, color=FAINT, lw=0.0, label="band, 1 % false alarm")
    axes.axhline(0.0, color=TRUTH, linewidth=0.8)
    trusted = records["verdict"].values != "unexplained"
    for which, colour, style, label in (
        (np.ones(trusted.size, dtype=bool), MODEL, "-", "all records"),
        (trusted, ACCENT, "--", "not unexplained"),
    ):
        places = np.sort(records["place"].values[which])
        # before and after each step
        reached = np.repeat(np.arange(places.size + 1) / places.size, 2)[1:-1]
        x = np.repeat(places, 2)
        y = reached - x
        axes.plot(x, y, style, color=colour, linewidth=1.2, label=label)
    axes.set(xlabel="posterior distribution function at the truth", xlim=(0.0, 1.0))
    axes.set_ylabel("empirical less uniform")
    axes.set_title(f"Ranks of friction, {test.pit.size} records")
    axes.set_ylim(-1.2 * reach, 1.75 * reach)
    axes.legend(loc="upper left", frameon=False)


def draw_reliability(axes: Axes, dataset: xr.Dataset) -> None:
    """Share of effects that acted against their stated probability, with two standard errors of chance."""
    table = reliability(dataset)
    table = table.isel(bin=(table["n"] > 0).values)
    stated, found, n = (table[name].values for name in ("stated", "true", "n"))
    error = 2.0 * np.sqrt(stated * (1.0 - stated) / n)
    axes.plot((0.0, 1.0), (0.0, 1.0), color=TRUTH, linewidth=0.8)
    axes.errorbar(stated, found, yerr=error, fmt="o", color=MODEL, markersize=4.0, capsize=2.0)
    for x, y, count in zip(stated, found, n, strict=True):
        axes.annotate(f"{count:.0f}", (x, y), xytext=(6, -10), textcoords="offset points", fontsize=7.0)
    axes.set(xlabel="stated probability of an effect", ylabel="share that acted", xlim=(-0.03, 1.12))
    axes.set_ylim(-0.05, 1.08)
    axes.set_title("Effects, by number of statements")


def main() -> None:
    """Draw ``loop_calibration.png`` from the results of ``loop_calibration``."""
    parser = figure_parser("experiments.loop_calibration_figures", __doc__, "docs/figures")
    options = parser.parse_args()
    (dataset,) = load_results(parser, options.results, ["loop_calibration"])
    options.out.mkdir(parents=True, exist_ok=True)
    with styled():
        figure = new_figure(8.6, 3.8)
        ranks, probabilities = figure.subplots(1, 2)
        draw_ranks(ranks, dataset)
        draw_reliability(probabilities, dataset)
        save_figure(figure, options.out, "loop_calibration", ("png",))


if __name__ == "__main__":
    main()
