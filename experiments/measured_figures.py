"""``python -m experiments.measured_figures``: a figure of every measured record, for the docs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from experiments.figures import figure_parser, load_results
from experiments.same_rig import RIGS, records_of
from friction_bayes.plotting.style import ACCENT, DATA, MODEL, new_figure, save_figure, styled

__all__ = ["draw", "draw_rigs", "main"]

_HALF_CYCLES_SHOWN = 6.0


def draw(case: xr.Dataset) -> Figure:
    """Signal under its fit, whole and at the end, and the residual."""
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
        panels["end"].set_title("its end", loc="right")
        panels["left"].plot(time, residual, color=ACCENT, lw=0.7)
        panels["left"].axhline(0.0, color="#999999", lw=0.6)
        panels["left"].set_ylabel(f"left over [{unit}]")
        panels["left"].set_xlabel("time [s]")
    return figure


def draw_rigs(dataset: xr.Dataset) -> Figure:
    """Friction of the records of each rig with 90 % intervals, without a random force and with one."""
    names = dataset["record"].values.tolist()
    rigs = {rig: places for rig in RIGS if len(places := records_of(rig, names)) > 1}
    with styled():
        figure = new_figure(8.6, 0.9 + 2.1 * len(rigs))
        panels = figure.subplots(len(rigs), 1, squeeze=False)[:, 0]
        for axes, (rig, places) in zip(panels, rigs.items(), strict=True):
            own = dataset.isel(case=places)
            for suffix, shift, color, style, label in (
                ("_without", -0.12, ACCENT, "s", "sensor noise alone"),
                ("", 0.12, MODEL, "o", "averaged over a random force"),
            ):
                mean, low, high = (own[f"{name}{suffix}"].values for name in ("friction", "low", "high"))
                place = np.arange(mean.size) + shift
                axes.errorbar(
                    place,
                    mean,
                    [mean - low, high - mean],
                    color=color,
                    fmt=style,
                    ms=4.0,
                    lw=1.6,
                    label=label,
                )
            axes.set_xticks(range(len(places)), [names[k].partition("/")[2] for k in places], fontsize=8.0)
            axes.set_ylabel(f"friction [{own['unit'].values[0]}]")
            axes.axhline(0.0, color="#999999", lw=0.6)
            axes.set_title(rig)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _shown(record: str) -> bool:
    """One release of each kind of the rig with twenty, every record of the others."""
    return not record.startswith("pasco-oscillator") or record.endswith("-1")


def main() -> None:
    """Draw the first method's fit of the records, and friction of those of one rig side by side."""
    parser = figure_parser("experiments.measured_figures", __doc__, "docs/figures/measured")
    options = parser.parse_args()
    (dataset,) = load_results(parser, options.results, ["measured_estimates"])
    options.out.mkdir(parents=True, exist_ok=True)
    for k in range(dataset.sizes["case"]):
        case = dataset.isel(case=k)
        first = case["method"].item() == dataset["method"].values[0]
        if first and _shown(case["record"].item()) and not case["refused"].item():
            save_figure(draw(case), options.out, case["record"].item().replace("/", "-"), formats=("png",))
    cases = dataset.isel(case=dataset["method"].values == dataset["method"].values[0])
    if any(len(records_of(rig, cases["record"].values.tolist())) > 1 for rig in RIGS):
        save_figure(draw_rigs(cases), options.out, "friction", formats=("png",))


if __name__ == "__main__":
    main()
