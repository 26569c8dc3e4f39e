"""What does condition monitoring look like for one machine? The schematic of Fig. 1 with numbers in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

import friction_bayes as fb
from experiments.monitoring import Config as Wear
from experiments.monitoring import follow_machine
from experiments.runner import Cell, Experiment, main
from experiments.tables import Row
from experiments.testbed_choices import DRAWN_PRIOR
from friction_bayes.mechanics.testbed import PAPER_SYSTEM

__all__ = ["EXPERIMENT", "Config"]

WAYS = ("forgetting", "plain", "chain")
"""Of updating by the whole signal, discounted and plain; and the paper's own pair, from record to record."""


@dataclass(frozen=True)
class Config:
    """A machine of :mod:`experiments.monitoring`, its law of wear, its detection points and the grids."""

    wear: Wear = field(default_factory=Wear)
    law: str = "both"
    points: int = 8
    grid: int = 401


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One machine."""
    return [{"law": config.law, "points": config.points}]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Follow one machine to Tn: f(r|Ti) with and without forgetting, and f(dt|Tn)."""
    wear, rng = config.wear, np.random.default_rng(seed)
    machine, records, report = follow_machine(wear, cell["law"], cell["points"], rng)
    times = report.points.times
    life = report.life
    assert life is not None
    low, middle, high = (float(life.ppf(q)) for q in (0.05, 0.5, 0.95))
    # a course of wear that slows down may never cross
    ahead = np.linspace(0.0, min(1.3 * float(life.ppf(0.97)), report.horizon), config.grid)
    reached = np.array([float(life.cdf(time)) for time in ahead])
    found: dict[str, Any] = {
        "time": times.tolist(),
        "friction": machine.shown.tolist(),
        "ahead": ahead.tolist(),
        "reached": reached.tolist(),
        "life": [low, middle, high],
        "true_life": machine.life,
        "threshold": wear.threshold,
    }
    for name, forgetting in (("forgetting", True), ("plain", False)):
        densities = [report.density(point, forgetting=forgetting) for point in range(times.size)]
        found[f"{name}_mean"] = [float(density.mean()) for density in densities]
        found[f"{name}_sd"] = [float(density.std()) for density in densities]
    return found | _own_chain(records)


def _own_chain(records: Sequence[xr.DataArray]) -> dict[str, list[float]]:
    """The paper's own chain: normal-gamma on each record, its posterior the prior of the next."""
    pair = fb.NormalGamma(**DRAWN_PRIOR)
    found: dict[str, list[float]] = {"chain_mean": [], "chain_sd": []}
    for record in records:
        pair = fb.estimate(record, PAPER_SYSTEM, method="normal-gamma", prior=pair).fit.posterior
        found["chain_mean"].append(float(pair.friction.mean()))
        found["chain_sd"].append(float(pair.friction.std()))
    return found


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Over ``time`` the detection points, over ``ahead`` the distribution function of the remaining life.

    Infinite quantiles, which JSON has not, are put back.
    """
    (one,) = results
    life = [math.inf if quantile is None else quantile for quantile in one["life"]]
    friction = {"units": "N"}
    data = {"true_friction": ("time", one["friction"], friction)}
    for name in WAYS:
        data[f"{name}_mean"] = ("time", one[f"{name}_mean"], friction)
        data[f"{name}_sd"] = ("time", one[f"{name}_sd"], friction)
    return xr.Dataset(
        data
        | {
            "reached": ("ahead", one["reached"], {"units": "1", "long_name": "threshold reached by then"}),
            "life": ("quantile", life, {"units": "h", "long_name": "remaining life"}),
            "true_life": ((), one["true_life"], {"units": "h"}),
            "threshold": ((), one["threshold"], friction),
        },
        coords={
            "time": ("time", one["time"], {"units": "h"}),
            "ahead": ("ahead", one["ahead"], {"units": "h", "long_name": "time from Tn"}),
            "quantile": [0.05, 0.5, 0.95],
        },
        attrs={"synthetic": 1},
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """The last point and the remaining life, and the truth of this machine."""
    truth = float(dataset["true_friction"][-1])
    table = []
    for name in WAYS:
        mean, sd = float(dataset[f"{name}_mean"][-1]), float(dataset[f"{name}_sd"][-1])
        low, high = stats.norm(mean, sd).interval(0.9)
        table.append(Row(f"f(r|Tn), {name}", f"{mean:.4f} [{low:.4f}, {high:.4f}] N", f"{truth:.4f} N"))
    low, middle, high = dataset["life"].values
    table.append(
        Row(
            "remaining life",
            f"{middle:.0f} [{low:.0f}, {high:.0f}] h",
            f"{float(dataset['true_life']):.0f} h",
        )
    )
    return table


EXPERIMENT = Experiment(
    name="shown_machine",
    question="what does condition monitoring look like for one machine?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="truth",
)

if __name__ == "__main__":
    main(EXPERIMENT)
