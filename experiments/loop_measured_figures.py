"""``python -m experiments.loop_measured_figures``: the loop on measured records, in figures for the docs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import friction_bayes as fb
from experiments.figures import figure_parser, load_results
from experiments.loop_measured import TARGET_RATIO
from experiments.pasco_together import KINDS
from experiments.pendulum_forecast import PUBLISHED
from friction_bayes.plotting.fluctuation import plot_fluctuation
from friction_bayes.plotting.style import ACCENT, FAINT, MODEL, caption, new_figure, save_figure, styled

__all__ = ["draw_forecasts", "draw_gains", "draw_knock", "draw_pull", "draw_residuals", "draw_story", "main"]

_COLUMNS = 4
_KNOCKED = "pasco-oscillator/magnet-3"


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
    """The residual of the final model, record by record."""
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
        axes.set_title(case["record"].item().replace("/", "\n"), fontsize=8.0)
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


def draw_story(dataset: xr.Dataset) -> Figure:
    """One record: what the Coulomb model leaves, and the force left by dry friction and by the law."""
    figure = new_figure(10.4, 6.4)
    upper, *panels = figure.subplot_mosaic([["left", "left"], ["dry", "law"]]).values()
    first = dataset.isel(law=0)
    time, signal, before = (first[name].dropna("sample").values for name in ("time", "signal", "before"))
    upper.axhline(0.0, color="#999999", lw=0.6)
    upper.plot(time, signal - before, ".-", color=ACCENT, lw=0.6, ms=2.5)
    upper.set_xlabel("time [s]")
    upper.set_ylabel(f"record - Coulomb model [{first['unit'].item()}]")
    upper.set_title("what the Coulomb model leaves")
    for k, axes in enumerate(panels, start=1):
        case = dataset.isel(law=k)
        x, v, force = (case[name].dropna("sample").values for name in ("displacement", "velocity", "force"))
        # against the motion: friction is positive
        for moving, marker, color in ((v > 0.0, "o", MODEL), (v < 0.0, "s", ACCENT)):
            label = "forwards" if color == MODEL else "backwards"
            against = -np.sign(v[moving]) * force[moving]
            axes.plot(x[moving], against, marker, color=color, ms=2.6, mew=0.0, alpha=0.7, label=label)
        axes.axhline(0.0, color="#999999", lw=0.6)
        for level in (-1.0, 1.0):
            axes.axhline(level * float(case["friction"]), color="#444444", lw=0.8, ls=(0, (4, 2)))
        axes.set_xlabel("position [rad]")
        axes.set_title(f"force left by {case['law'].item()}", fontsize=10.0)
    low = min(axes.get_ylim()[0] for axes in panels)
    high = max(axes.get_ylim()[1] for axes in panels)
    # room for the legend above the dashed line
    for axes in panels:
        axes.set_ylim(low, high + 0.4 * (high - low))
    panels[0].set_ylabel(f"against the motion [{first['force_unit'].item()}]")
    panels[1].legend(loc="upper right", title="dashed: ± friction", fontsize=8.0, title_fontsize=8.0)
    return figure


def draw_pull(dataset: xr.Dataset) -> Figure:
    """The force that repeats with every turn, as either kind of releases has it."""
    figure = new_figure(5.8, 3.4)
    axes = figure.add_subplot()
    axes.axhline(0.0, color="#999999", lw=0.6)
    angle = dataset["angle"].values
    for (kind, words), color in zip(KINDS.items(), (MODEL, ACCENT), strict=True):
        case = dataset.sel(kind=kind)
        mean, sd = case["pull"].values, case["pull_sd"].values
        axes.plot(angle, mean, color=color, lw=1.6, label=f"ten releases {words}")
        axes.fill_between(angle, mean - 2.0 * sd, mean + 2.0 * sd, color=color, alpha=0.2, lw=0.0)
    axes.set_xlabel("angle [rad]")
    axes.set_ylabel("position force [N m]")
    caption(axes, "less its best line, which goes with the spring; bands: 2 sd")
    axes.legend(loc="best", fontsize=8.0)
    return figure


def draw_knock(seed: int) -> Figure:
    """The force that is left in a release with a knock, whose loop is closed anew."""
    record, system = fb.dataset_record(_KNOCKED)
    report = fb.close_loop([record], system, seed=seed)
    return plot_fluctuation(report.traces[0])


def main() -> None:
    """Draw from the results of the experiments on measured records."""
    parser = figure_parser("experiments.loop_measured_figures", __doc__, "docs/figures")
    parser.add_argument("--law", default="the catalogue", help="drawn with the published one (%(default)s)")
    options = parser.parse_args()
    names = ("loop_measured", "pendulum_forecast", "measured_story", "pasco_together")
    measured, forecasts, story, together = load_results(parser, options.results, names)
    options.out.mkdir(parents=True, exist_ok=True)
    with styled():
        drawn = {
            "loop_measured_gains": draw_gains(measured),
            "loop_measured_residuals": draw_residuals(measured),
            "pendulum_forecast": draw_forecasts(forecasts, options.law),
            "measured_story": draw_story(story),
            "position_force": draw_pull(together),
            "knock": draw_knock(int(measured.attrs["seed"])),
        }
    for name, figure in drawn.items():
        save_figure(figure, options.out, name, formats=("png",))


if __name__ == "__main__":
    main()
