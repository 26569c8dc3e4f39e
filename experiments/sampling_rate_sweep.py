"""How fast must one sample? Table 2: the last fifth of a 2.9 Hz decay, down-sampled from 1 kHz."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from experiments.beside_paper import detail_rows, verdict_rows
from experiments.closed_forms import SweepConfig, gather, measure, seeds_of, sweep_cells
from experiments.reduced_data_set import DATA_SETS, last_part, paper_rows
from experiments.runner import Cell, Experiment, main
from experiments.tables import Row
from friction_bayes.mechanics.testbed import TESTBED, paper_testbed, simulate

__all__ = ["EXPERIMENT", "Config"]

FRICTION = DATA_SETS["2"]

PAPER = {1000.0: (0.1643, 32.2), 100.0: (0.1567, 32.9), 10.0: (0.1465, 27.5)}
"""Estimated friction [N] and precision [1/N^2] of Table 2, by sampling rate [Hz]."""

LEVELS = {"sampling_rate": "Hz", "quantity": "1"}


@dataclass(frozen=True)
class Config(SweepConfig):
    """What fraction of the 1 kHz samples is kept, of which sensor, and the share of the motion used."""

    records: int = 100
    keep_every: tuple[int, ...] = (1, 5, 10, 20, 40, 100)
    keep_every_full: tuple[int, ...] = (1, 2, 5, 10, 20, 40, 50, 80, 100)
    quantities: tuple[str, ...] = ("acceleration", "displacement")
    last_share: float = 0.2


RATE = 1000.0
"""Of the record that is down-sampled [Hz]."""


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every rate of every sensor."""
    rates = [RATE / step for step in (config.keep_every_full if full else config.keep_every)]
    return sweep_cells({"sampling_rate": rates, "quantity": config.quantities}, config, full)


def _record(quantity: str, seed: int) -> xr.DataArray:
    """The rig's accelerometer, or a displacement sensor with the same noise in share of its signal."""
    record = paper_testbed(FRICTION, seed=seed)
    if quantity == "acceleration":
        return record
    return simulate(
        TESTBED,
        friction=FRICTION,
        initial_displacement=record.attrs["initial_displacement"],
        duration=record.attrs["duration"],
        sampling_rate=RATE,
        noise_sd=record.attrs["noise_sd"] / TESTBED.natural_frequency**2,
        seed=seed,
        name="testbed, displacement (synthetic)",
    )


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Every rate is cut from the very same record, as in the paper.

    Which of its samples are kept is drawn: the clock of a sensor knows nothing of the release.
    """
    of_noise, of_sampler = seeds_of(cell, seed)
    record = last_part(_record(cell["quantity"], of_noise), config.last_share)
    step = round(RATE / cell["sampling_rate"])
    first = np.random.default_rng(np.random.SeedSequence(of_noise, spawn_key=(1,))).random()
    record = record.isel(time=slice(int(first * step), None, step))
    return measure(record, TESTBED, FRICTION, methods=config.methods, check=cell["check"], seed=of_sampler)


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Dimensions sampling_rate, quantity, replicate, method."""
    return gather(cells, results, levels=LEVELS)


def rows(dataset: xr.Dataset) -> list[Row]:
    """Table 2, which is of acceleration."""
    table: list[Row] = []
    for rate in dataset["sampling_rate"].values.tolist():
        if rate in PAPER:
            at_level = dataset.sel(sampling_rate=rate, quantity="acceleration")
            table += paper_rows(at_level, f"{rate:g} Hz (true {FRICTION:g} N)", *PAPER[rate])
    for quantity in dataset["quantity"].values.tolist():
        verdicts = verdict_rows(dataset.sel(quantity=quantity))
        table += [replace(row, what=f"{quantity}, {row.what}") for row in verdicts]
    return table


EXPERIMENT = Experiment(
    name="sampling_rate_sweep",
    question="how fast must one sample?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("sampling_rate", "quantity", "check"),
    details=lambda dataset: detail_rows(dataset, tuple(reversed(LEVELS))),
)

if __name__ == "__main__":
    main(EXPERIMENT)
