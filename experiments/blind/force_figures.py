"""Tables of the sealed records with a fluctuating force: each figure with one evaluated, and without."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from experiments.blind.figures_of_merit import median_error, rate_error, reliability, reliability_limit
from experiments.blind.fluctuating import FLUCTUATING_KINDS
from experiments.blind.force_scoring import FOUND
from experiments.blind.identifiable import IDENTIFIABLE_LOSS

__all__ = ["AFTER", "BEFORE", "Line", "by_kind", "figure_lines", "reliability_lines"]

BEFORE, AFTER = "before", "after"
"""Prefixes of the columns: sensor noise alone, and with a random force evaluated too."""

_FORCE_SIZES = (0.05, 0.15, 0.3, 0.6)  # of friction
_GROSS = 1.0  # widths of its 90 % interval that the truth lies from the mean

Mask = NDArray[np.bool_]
Shown = Callable[[xr.Dataset, Mask], str]


@dataclass(frozen=True)
class Line:
    """One figure: what, as it is with a random force evaluated, what to reach, and what it was without."""

    what: str
    after: str
    target: str
    before: str
    n: int


def columns_of(dataset: xr.Dataset, run: str) -> xr.Dataset:
    """The columns of one run under their own names."""
    names = [str(name) for name in dataset.variables if str(name).startswith(f"{run}_")]
    return xr.Dataset({name.removeprefix(f"{run}_"): dataset[name] for name in names})


def _share(good: NDArray[Any], eligible: Mask) -> str:
    """Rate with its Monte Carlo error; entries of NaN are not counted."""
    values = good[eligible].astype(float)
    values = values[np.isfinite(values)]
    if not values.size:
        return "-"
    share = float(values.mean())
    return f"{100.0 * share:.0f} ± {100.0 * rate_error(share, values.size):.0f} %"


def _rate_of(column: str) -> Shown:
    return lambda run, eligible: _share(run[column].values, eligible)


def _median_of(column: str) -> Shown:
    def shown(run: xr.Dataset, eligible: Mask) -> str:
        values = run[column].values[eligible]
        return f"{100.0 * np.median(values):.2g} ± {100.0 * median_error(values):.1g} %"

    return shown


def _found(run: xr.Dataset, eligible: Mask) -> str:
    return _share(run["force_probability"].values >= FOUND, eligible)


def _gross(run: xr.Dataset, eligible: Mask) -> str:
    return _share(run["widths_off"].values > _GROSS, eligible)


def _width_over_best(dataset: xr.Dataset) -> Shown:
    best = 2.0 * stats.norm.ppf(0.95) * dataset["friction_sd"].values

    def shown(run: xr.Dataset, eligible: Mask) -> str:
        values = (run["relative_width"].values / best)[eligible]
        return f"{np.median(values):.2g} ± {median_error(values):.1g}"

    return shown


def _verdict(name: str) -> Shown:
    return lambda run, eligible: _share(run["verdict"].values == name, eligible)


def _figures(dataset: xr.Dataset) -> Iterator[tuple[str, str, Mask, Shown]]:
    """What, target, records that are counted, and how the columns of one run are shown."""
    force = dataset["fluctuates"].values.astype(bool)
    outside = dataset["outside"].values.astype(bool)
    size, quantity = dataset["force_over_friction"].values, dataset["quantity"].values
    inside = force & ~outside
    sizes = [
        (f"... force {low:g} .. {high:g} of friction", inside & (size >= low) & (size < high))
        for low, high in pairwise(_FORCE_SIZES)
    ]
    covers, held = _rate_of("covered"), _rate_of("held")
    yield "friction_after 90 % interval covers the truth", "86 .. 94 %", inside, covers
    for name, chosen in sizes:
        yield name, "", chosen, covers
    for name in ("displacement", "angle", "acceleration"):
        yield f"... {name}", "", inside & (quantity == name), covers
    yield "truth further from the mean than the interval is wide", "", inside, _gross
    yield "median friction error", "", inside, _median_of("error_after")
    yield "median width of the interval, over friction", "", inside, _median_of("relative_width")
    yield "... over that of a judge who knows effects, force and noise", "", inside, _width_over_best(dataset)
    yield "true set of other effects among those that add up to 95 %", ">= 95 %", inside, held
    identifiable = inside & dataset["identifiable"].values.astype(bool)
    yield "true set of other effects most probable, identifiable records", "", identifiable, _rate_of("right")
    seen = inside & (dataset["force_loss"].values >= IDENTIFIABLE_LOSS)
    yield "random force found, where the true law loses 10 or more without it", "", seen, _found
    for name, chosen in sizes:
        yield name, "", seen & chosen, _found
    yield "90 % interval of random_force.sd covers, where given", "", inside, _rate_of("force_sd_covered")
    what = "90 % interval of random_force.correlation_time_s covers, where given"
    yield what, "", inside, _rate_of("correlation_time_covered")
    yield "predictive 90 % band covers held-out samples, where given", "80 .. 97 %", inside, _rate_of("band")
    yield "newer kinds, no force: friction interval covers", "85 .. 95 %", ~force, covers
    yield "newer kinds, no force: true set among those that add up to 95 %", ">= 95 %", ~force, held
    yield "newer kinds, no force: random force found", "", ~force, _found
    yield "outside the catalogue: called unexplained", "", force & outside, _verdict("unexplained")
    yield "refused", "0 %", np.ones(force.size, dtype=bool), _verdict("refused")


def figure_lines(dataset: xr.Dataset) -> list[Line]:
    """Every figure, and the largest deviation of the reliability diagram.

    Parameters
    ----------
    dataset : xarray.Dataset
        One entry a record: ``kind``, ``fluctuates``, ``outside``, ``quantity``, ``force_over_friction``, what
        :func:`experiments.blind.oracle.judge` returns for it, and for both runs, by prefix, the fields of
        :func:`experiments.blind.force_scoring.force_score`.
    """
    before, after = columns_of(dataset, BEFORE), columns_of(dataset, AFTER)
    lines = [
        Line(what, shown(after, eligible), target, shown(before, eligible), int(eligible.sum()))
        for what, target, eligible, shown in _figures(dataset)
    ]
    evaluated = _evaluated(dataset)
    diagrams = [reliability(run, evaluated) for run in (after, before)]
    worst = [f"{float(np.abs(diagram['z']).max()):.2f}" for diagram in diagrams]
    what = "probabilities of the other effects against frequencies, largest |z| of a bin"
    target = f"<= {reliability_limit(diagrams[0]):.2f}"
    return [*lines, Line(what, worst[0], target, worst[1], int(evaluated.sum()))]


def _evaluated(dataset: xr.Dataset) -> Mask:
    inside: Mask = dataset["fluctuates"].values.astype(bool) & ~dataset["outside"].values.astype(bool)
    return inside


def reliability_lines(dataset: xr.Dataset) -> list[tuple[str, str, str, str]]:
    """Bins of the reliability diagram with a random force evaluated: stated, true, mean stated, z, number."""
    diagram = reliability(columns_of(dataset, AFTER), _evaluated(dataset))
    return [
        (
            f"stated {entry['low'].item():g} .. {entry['high'].item():g}",
            f"true in {entry['frequency'].item():.3f}",
            f"{entry['stated'].item():.3f}",
            f"z {entry['z'].item():.1f}, {entry['n'].item()} candidates",
        )
        for entry in (diagram.isel(bin=b) for b in range(diagram.sizes["bin"]))
        if entry["n"].item()
    ]


def by_kind(dataset: xr.Dataset) -> list[dict[str, str]]:
    """Kind by kind: sensor noise alone, then with a random force evaluated."""
    before, after = columns_of(dataset, BEFORE), columns_of(dataset, AFTER)
    force = dataset["fluctuates"].values.astype(bool)
    lines = []
    for fluctuates in (True, False):
        for kind in FLUCTUATING_KINDS:
            mine = (dataset["kind"].values == kind) & (force == fluctuates)
            if not mine.any():
                continue

            def shares(column: str, mine: Mask = mine) -> str:
                return ", ".join(f"{100.0 * run[column].values[mine].mean():.0f}" for run in (before, after))

            def medians(column: str, mine: Mask = mine) -> str:
                values = (100.0 * float(np.median(run[column].values[mine])) for run in (before, after))
                return ", ".join(f"{value:.2g}" for value in values)

            gross = (int(np.sum(run["widths_off"].values[mine] > _GROSS)) for run in (before, after))
            bands = after["band"].values[mine]
            bands = bands[np.isfinite(bands)]
            verdicts = after["verdict"].values[mine]
            found = after["force_probability"].values[mine] >= FOUND
            lines.append(
                {
                    "kind": kind.replace("_", " ") + ("" if fluctuates else ", no force"),
                    "records": str(int(mine.sum())),
                    "interval covers [%]": shares("covered"),
                    "truth further off than its width": ", ".join(map(str, gross)),
                    "friction off [%]": medians("error_after"),
                    "truth within the 95 % [%]": shares("held"),
                    "force found [%]": f"{100.0 * found.mean():.0f}",
                    "band covers [%]": f"{100.0 * bands.mean():.0f}" if bands.size else "-",
                    "verdicts": ", ".join(
                        f"{name} {np.sum(verdicts == name)}" for name in np.unique(verdicts)
                    ),
                }
            )
    return lines
