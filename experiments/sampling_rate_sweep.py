"""How fast must one sample? Table 2: the last fifth of a 2.9 Hz decay, down-sampled from 1 kHz."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_emcee import verdict_rows
from experiments.against_paper import detail_rows
from experiments.closed_forms import measure
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS, last_begins, last_part, paper_rows
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import SweepConfig, gather, seeds_of, sweep_cells
from experiments.tables import Row

__all__ = ["EXPERIMENT", "FRICTION", "Config", "down_sampled"]

FRICTION = DATA_SETS["2"]

PAPER = {
    1000.0: (printed("estimate-reduced"), printed("precision-reduced")),
    100.0: (printed("estimate-100"), printed("precision-100")),
    10.0: (printed("estimate-10"), printed("precision-10")),
}
"""Estimated friction [N] and precision [1/N^2] of Table 2, by sampling rate [Hz]."""

LEVELS = {"sampling_rate": "Hz", "quantity": "1"}


@dataclass(frozen=True)
class Config(SweepConfig):
    """What fraction of the 1 kHz samples is kept, of which sensor, and the share of the motion used."""

    records: int = 100
    rig: Rig = field(default_factory=Rig)
    keep_every: tuple[int, ...] = (1, 5, 10, 20, 40, 100)
    keep_every_full: tuple[int, ...] = (1, 2, 5, 10, 20, 40, 50, 80, 100)
    quantities: tuple[str, ...] = ("acceleration", "displacement")
    last_share: float = 0.2


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every rate of every sensor."""
    steps = config.keep_every_full if full else config.keep_every
    rates = [config.rig.sampling_rate / step for step in steps]

    def of_paper(known: Mapping[str, Any]) -> bool:
        return known["sampling_rate"] in PAPER and known["quantity"] == "acceleration"

    return sweep_cells(
        {"sampling_rate": rates, "quantity": config.quantities}, config, full, of_paper=of_paper
    )


def down_sampled(record: xr.DataArray, step: int, seed: int) -> xr.DataArray:
    """Keep every ``step``-th sample; the first is drawn, since a clock knows nothing of the release.

    Parameters
    ----------
    record : xarray.DataArray
    step : int
    seed : int
        Of the run, so that all rates of one run start from one draw.
    """
    first = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1,))).random()
    return record.isel(time=slice(int(first * step), None, step))


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Every rate is cut from the very same record, as in the paper."""
    of_noise, of_sampler = seeds_of(cell, seed)
    signals = run_rig(config.rig, FRICTION, seed=of_noise)
    whole = signals[cell["quantity"]]
    step = round(config.rig.sampling_rate / cell["sampling_rate"])
    record = down_sampled(last_part(whole, config.last_share), step, of_noise)
    return measure(
        record,
        system_of(config.rig),
        true_friction(signals, last_begins(whole, config.last_share)),
        methods=config.methods,
        check=cell["check"],
        seed=of_sampler,
    )


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
    paired=("sampling_rate", "quantity"),
    common_records=True,
    details=lambda dataset: detail_rows(dataset, tuple(reversed(LEVELS))),
)

if __name__ == "__main__":
    main(EXPERIMENT)
