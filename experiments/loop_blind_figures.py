"""``python -m experiments.loop_blind_figures``: the sealed test of the loop, in figures for the docs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from experiments.blind.generator import KINDS
from experiments.figures import figure_parser, load_results
from friction_bayes.plotting.style import ACCENT, DATA, FAINT, MODEL, TRUTH, new_figure, save_figure, styled

__all__ = ["draw_errors", "draw_reliability", "draw_verdicts", "main"]

_VERDICTS = {
    "adequate": FAINT,
    "explained": MODEL,
    "ambiguous": "#7fb2d9",
    "unexplained": ACCENT,
    "refused": TRUTH,
}


def draw_reliability(axes: Axes, dataset: xr.Dataset) -> None:
    """Frequency of the truth against the stated probability, with two standard errors of chance."""
    n = dataset["reliability_n"].values
    kept = n > 0
    stated, found = (dataset[f"reliability_{name}"].values[kept] for name in ("stated", "frequency"))
    error = 2.0 * np.sqrt(stated * (1.0 - stated) / n[kept])
    axes.plot((0.0, 1.0), (0.0, 1.0), color=TRUTH, linewidth=0.8)
    axes.errorbar(stated, found, yerr=error, fmt="o", color=MODEL, markersize=4.0, capsize=2.0)
    for k, (x, y, count) in enumerate(zip(stated, found, n[kept], strict=True)):
        # above and below in turn: the first bins are close
        at = (5, 6 if k % 2 else -10)
        axes.annotate(str(int(count)), (x, y), xytext=at, textcoords="offset points", fontsize=7.0)
    axes.set(xlabel="stated probability", ylabel="share that was true", xlim=(-0.03, 1.05))
    axes.set_ylim(-0.05, 1.08)
    axes.set_title("Stated probabilities, by number of candidates")


def draw_errors(axes: Axes, dataset: xr.Dataset) -> None:
    """Relative error of friction before and after, record by record, and the two targets."""
    inside = ~dataset["outside"].values.astype(bool) & (dataset["kind"].values != "plain_coulomb")
    identifiable = dataset["identifiable"].values.astype(bool)
    before, after = (
        np.clip(100.0 * dataset[f"error_{name}"].values, 1e-3, 300.0) for name in ("before", "after")
    )
    for mask, colour, label in (
        (inside & ~identifiable, DATA, "a rival is within 10 in chi-square"),
        (inside & identifiable, MODEL, "identifiable"),
    ):
        axes.loglog(before[mask], after[mask], "o", color=colour, markersize=3.0, label=label)
    ends = np.array([1e-3, 300.0])
    axes.loglog(ends, ends, color=TRUTH, linewidth=0.8)
    axes.loglog(ends, 0.1 * ends, color=TRUTH, linewidth=0.8, linestyle="--", label="a tenth")
    axes.set(xlabel="friction off before [%]", ylabel="after [%]", xlim=ends, ylim=ends)
    axes.figure.legend(loc="outside lower center", ncols=2)
    axes.set_title("Friction error, records of the catalogue")


def draw_verdicts(axes: Axes, dataset: xr.Dataset) -> None:
    """Share of each verdict by kind of record."""
    kinds = [kind for kind in KINDS if kind in dataset["kind"].values]
    left = np.zeros(len(kinds))
    for verdict, colour in _VERDICTS.items():
        said = dataset["verdict"].values == verdict
        share = np.array([said[dataset["kind"].values == kind].mean() for kind in kinds])
        if share.any():
            axes.barh(range(len(kinds)), share, left=left, color=colour, label=verdict, height=0.75)
        left += share
    axes.set_yticks(range(len(kinds)), [kind.replace("_", " ") for kind in kinds])
    axes.invert_yaxis()
    axes.set(xlabel="share of the records", xlim=(0.0, 1.0))
    axes.legend(loc="upper center", bbox_to_anchor=(0.4, 1.1), ncols=4, frameon=False)


def main() -> None:
    """Draw ``loop_blind_*.png`` from the results of ``loop_blind``."""
    parser = figure_parser("experiments.loop_blind_figures", __doc__, "docs/figures")
    options = parser.parse_args()
    (dataset,) = load_results(parser, options.results, ["loop_blind"])
    options.out.mkdir(parents=True, exist_ok=True)
    for name, draw, size in (
        ("reliability", draw_reliability, (4.6, 4.0)),
        ("errors", draw_errors, (4.6, 4.0)),
        ("verdicts", draw_verdicts, (6.2, 4.6)),
    ):
        with styled():
            figure = new_figure(*size)
            draw(figure.add_subplot(), dataset)
            save_figure(figure, options.out, f"loop_blind_{name}", ("png",))


if __name__ == "__main__":
    main()
