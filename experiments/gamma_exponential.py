"""What does the gamma-exponential pair estimate? Fig. 3: it converges, and not to the friction."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled, word
from experiments.against_paper import band
from experiments.paper_numbers import printed
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row
from friction_bayes.conjugate.gamma_exponential import negative_share
from friction_bayes.mechanics.testbed import PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["EXPERIMENT", "Config"]

FRICTION = printed("example-friction")
"""Of the paper's example [N], [m]; other levels are the same decay, larger or smaller."""

VARIABLES = {
    "estimate": ("1/N", "posterior mean of what the pair calls friction"),
    "low": ("1/N", "lower end of the 90 % interval"),
    "high": ("1/N", "upper end of the 90 % interval"),
    "inverted": ("N", "1 over the posterior mean"),
    "inverted_low": ("N", "lower end of the 90 % interval of 1/r"),
    "inverted_high": ("N", "upper end of the 90 % interval of 1/r"),
    "negative_share": ("1", "share of friction samples below zero"),
    "normal_gamma": ("N", "posterior mean of the normal-gamma pair on the same samples"),
    **SAMPLED,
}


@dataclass(frozen=True)
class Config:
    """True frictions [N]; noise and release in proportion, so that all records have the same 51 periods."""

    frictions: tuple[float, ...] = (0.01, 0.03, FRICTION, 0.2, 0.5, 1.0, 3.0)
    records: int = 40
    records_paper: int = 200
    records_full: int = 400
    checked: int = CHECKED
    noise_sd: float = printed("example-noise")


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every level; the paper's own with more records."""
    few = config.records_full if full else config.records
    return [
        {"friction": friction, "replicate": replicate, "check": replicate < config.checked}
        for friction in config.frictions
        for replicate in range(max(few, config.records_paper) if friction == FRICTION else few)
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Estimate by both pairs of the paper on the same samples."""
    of_noise, of_sampler = seed.generate_state(2).tolist()
    friction = cell["friction"]
    scale = friction / FRICTION
    record = fb.simulate(
        PAPER_SYSTEM,
        friction=friction,
        initial_displacement=scale * PAPER_RELEASE,
        duration=printed("example-duration"),
        sampling_rate=printed("rig-sampling-rate"),
        noise_sd=scale * config.noise_sd,
        seed=of_noise,
    )
    estimate = fb.estimate(record, PAPER_SYSTEM, method="gamma-exponential")
    rate = estimate.friction
    low, high = float(rate.ppf(0.05)), float(rate.ppf(0.95))
    normal = fb.estimate(record, PAPER_SYSTEM, method="normal-gamma")
    found = {
        "estimate": float(rate.mean()),
        "low": low,
        "high": high,
        "inverted": 1.0 / float(rate.mean()),
        "inverted_low": 1.0 / high,
        "inverted_high": 1.0 / low,
        "negative_share": negative_share(estimate.fit.target.observed),
        "normal_gamma": float(normal.friction.mean()),
    }
    if cell["check"]:
        found |= sampled(estimate, seed=of_sampler)
    return {name: found.get(name, math.nan) for name in VARIABLES}


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions friction (true) and replicate; nan where a level has fewer records."""
    return lay_out(cells, results, dims=("friction", "replicate"), variables=VARIABLES)


def rows(dataset: xr.Dataset) -> list[Row]:
    """The pair's estimate, and 1 over the friction."""
    table = []
    for friction in dataset["friction"].values.tolist():
        mine = dataset.sel(friction=friction).dropna("replicate", subset=["estimate"])
        n = mine.sizes["replicate"]
        held = int(((mine["low"] <= friction) & (friction <= mine["high"])).sum())
        right = int(((mine["inverted_low"] <= friction) & (friction <= mine["inverted_high"])).sum())
        table.append(
            Row(
                f"true {friction:g} N: posterior mean",
                f"{band(mine['estimate'])} 1/N",
                "a wrong value (Fig. 3)" if friction == FRICTION else "",
                f"1/friction = {1.0 / friction:.4g} 1/N; its interval covers {friction:g} in {held} of {n}; "
                f"read as 1/r it is {band(mine['inverted'])} N and covers it in {right} of {n}; "
                f"{100.0 * float(mine['negative_share'].mean()):.0f} % of the samples are negative",
                word(mine),
            )
        )
    return table


EXPERIMENT = Experiment(
    name="gamma_exponential",
    question="what does the gamma-exponential pair estimate?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("friction",),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
