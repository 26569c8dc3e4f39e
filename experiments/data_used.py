"""How much data does an estimate need, and does its precision parameter say so? Fig. 4 of the paper."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled_pair, verdict_rows, word
from experiments.against_paper import band
from experiments.friction_statistics import ALL_SAMPLES, EVERY_COUNT, SPACED_COUNTS
from experiments.paper_numbers import printed
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row
from friction_bayes.mechanics.testbed import PAPER_SYSTEM, paper_example

__all__ = ["EXPERIMENT", "Config"]

FRICTION = printed("example-friction")
SHOWN = (5, 10, 25, ALL_SAMPLES)
"""Numbers of samples that the table shows and emcee checks."""

VARIABLES = {
    "friction": ("N", "posterior mean of the friction"),
    "sd": ("N", "posterior standard deviation of the friction"),
    "precision": ("1/N^2", "posterior mean of the precision"),
    **SAMPLED,
}


@dataclass(frozen=True)
class Config:
    """Records, how the peaks are picked, and how many records go through emcee."""

    records: int = 200
    records_full: int = 1000
    peaks: tuple[str, ...] = ("highest", "nominal")
    checked: int = CHECKED


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One record a cell; the first ones go through emcee at the numbers of samples that are shown."""
    return [
        {"replicate": replicate, "check": replicate < config.checked}
        for replicate in range(config.records_full if full else config.records)
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Update with the first friction samples of a record, more and more of them, Eqs. (5)-(8)."""
    of_noise, of_sampler = seed.generate_state(2).tolist()
    record = paper_example(of_noise)
    columns: dict[str, list[float]] = {name: [] for name in VARIABLES}
    for peaks in config.peaks:
        estimate = fb.estimate(record, PAPER_SYSTEM, method="normal-gamma", peaks=peaks)
        samples = np.asarray(estimate.fit.target.observed)
        prior = fb.NormalGamma(**estimate.prior)
        for count in EVERY_COUNT:
            used = samples[:count]
            found = {} if used.size < count else _figures(prior, used)
            if found and cell["check"] and count in SHOWN:
                found |= sampled_pair(prior, used, seed=of_sampler)
            for name, column in columns.items():
                column.append(found.get(name, math.nan))
    return {"peaks": list(config.peaks), "samples": list(EVERY_COUNT), **columns}


def _figures(prior: fb.NormalGamma, samples: np.ndarray) -> dict[str, float]:
    posterior = prior.update(samples)
    return {
        "friction": posterior.mu,
        "sd": float(posterior.friction.std()),
        "precision": float(posterior.precision.mean()),
    }


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions replicate, peaks, samples; rank correlations over every number of samples and over some."""
    inner = {name: results[0][name] for name in ("peaks", "samples")}
    dataset = lay_out(cells, results, dims=("replicate",), variables=VARIABLES, inner=inner)
    error, spaced = abs(dataset["friction"] / FRICTION - 1.0), list(SPACED_COUNTS)
    return dataset.assign_attrs(friction=FRICTION).assign(
        along_record=_correlation(dataset["precision"], error, "samples"),
        along_spaced=_correlation(
            dataset["precision"].sel(samples=spaced), error.sel(samples=spaced), "samples"
        ),
        across_records=_correlation(dataset["precision"], error, "replicate"),
    )


def _correlation(precision: xr.DataArray, error: xr.DataArray, dim: str) -> xr.DataArray:
    """Rank correlation of precision and size of the error along ``dim``."""

    def spearman(first: np.ndarray, second: np.ndarray) -> float:
        kept = np.isfinite(first) & np.isfinite(second)
        return float(stats.spearmanr(first[kept], second[kept]).statistic) if kept.sum() > 2 else math.nan

    found = xr.apply_ufunc(spearman, precision, error, input_core_dims=[[dim], [dim]], vectorize=True)
    return found.assign_attrs(units="1", long_name=f"rank correlation of precision and |error| along {dim}")


def rows(dataset: xr.Dataset) -> list[Row]:
    """The paper's statements about its Fig. 4, and ours."""
    table = []
    for peaks in dataset["peaks"].values.tolist():
        mine = dataset.sel(peaks=peaks)
        for count in SHOWN:
            at = mine.sel(samples=count)
            table.append(
                Row(
                    f"{peaks}, {count} samples: |error| and precision",
                    f"{band(abs(at['friction'] / FRICTION - 1.0), factor=100.0)} %; "
                    f"{band(at['precision'])} 1/N^2",
                    sampler=word(at),
                )
            )
        for variable, grid in (
            ("along_record", "every number of samples"),
            ("along_spaced", f"{len(SPACED_COUNTS)} numbers spaced logarithmically"),
        ):
            table.append(
                Row(
                    f"{peaks}: rank correlation of precision and |error| along a record, {grid}",
                    band(mine[variable]),
                    "negative (Fig. 4)",
                    "the more data, the better the estimate; the precision changes little once it is known",
                )
            )
        last = mine["across_records"].isel(samples=-1)
        table.append(
            Row(
                f"{peaks}: the same across records of equal length",
                f"{float(last):.3g}",
                "negative (a criterion)",
                f"chance alone is within {1.96 / math.sqrt(mine.sizes['replicate'] - 1):.2g} of zero",
            )
        )
    return table + verdict_rows(dataset, "peaks")


EXPERIMENT = Experiment(
    name="data_used",
    question="how much data does an estimate need, and does its precision say so?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
