"""What is left of an estimate on the last fifth of a record? Table 1, on a twin of the paper's testbed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_emcee import verdict_rows, word
from experiments.against_paper import band, compared, detail_rows
from experiments.closed_forms import measure
from experiments.paper_numbers import printed
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import SweepConfig, gather, seeds_of, sweep_cells
from experiments.tables import Row

__all__ = ["DATA_SETS", "EXPERIMENT", "Config", "last_begins", "last_part", "paper_rows"]

DATA_SETS = {
    "1": printed("reference-1"),
    "2": printed("reference-2"),
    "2-reduced": printed("reference-2"),
}
"""Measured friction [N] of Table 1, about which the twin's friction varies."""

PAPER = {
    "1": (printed("estimate-1"), printed("precision-1")),
    "2": (printed("estimate-2"), printed("precision-2")),
    "2-reduced": (printed("estimate-reduced"), printed("precision-reduced")),
}
"""Estimated friction [N] of Table 1 and precision [1/N^2] of section 4."""

LEVELS = {"data_set": "1"}


@dataclass(frozen=True)
class Config(SweepConfig):
    """Data sets of Table 1, and the share of the motion that the reduced one keeps."""

    rig: Rig = field(default_factory=Rig)
    data_sets: tuple[str, ...] = tuple(DATA_SETS)
    last_share: float = 0.2


def last_begins(record: xr.DataArray, share: float) -> float:
    """When the last ``share`` of the motion begins [s]."""
    return (1.0 - share) * float(record.attrs["stop_time"])


def last_part(record: xr.DataArray, share: float) -> xr.DataArray:
    """Return the last ``share`` of the motion and the rest after it, on the clock of the whole record."""
    return record.isel(time=record["time"].values >= last_begins(record, share))


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every data set."""
    return sweep_cells({"data_set": config.data_sets}, config, full)


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """The reduced set is cut from the very record of data set 2."""
    of_noise, of_sampler = seeds_of(cell, seed)
    data_set = cell["data_set"]
    signals = run_rig(config.rig, DATA_SETS[data_set], seed=of_noise)
    record, since = signals["acceleration"], 0.0
    if data_set == "2-reduced":
        since = last_begins(record, config.last_share)
        record = last_part(record, config.last_share)
    return measure(
        record,
        system_of(config.rig),
        true_friction(signals, since),
        methods=config.methods,
        check=cell["check"],
        seed=of_sampler,
    )


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Dimensions data_set, replicate, method."""
    return gather(cells, results, levels=LEVELS)


def paper_rows(at_level: xr.Dataset, name: str, friction: float, precision: float) -> list[Row]:
    """Friction by every method that estimates it, and the precision parameter, with the paper's.

    Parameters
    ----------
    at_level : xarray.Dataset
        One level, over ``replicate`` and ``method``.
    name : str
        Of the level.
    friction, precision : float
        The paper's numbers [N], [1/N^2].
    """
    rows = []
    for method in at_level["method"].values.tolist():
        mine = at_level.sel({"method": method})
        checked = word(mine)
        what = f"{name}: friction, {method}"
        if method.startswith("normal-gamma"):
            rows.append(compared(what, mine["friction"], friction, unit="N", digits=4, sampler=checked))
            rows.append(compared(f"{name}: precision, {method}", mine["precision"], precision, unit="1/N^2"))
        elif method != "gamma-exponential":
            ours = f"{band(mine['friction'], digits=4)} N"
            rows.append(Row(what, ours, f"{friction:g} N", "not the paper's method", checked))
    return rows


def rows(dataset: xr.Dataset) -> list[Row]:
    """Table 1."""
    table: list[Row] = []
    for data_set in dataset["data_set"].values.tolist():
        name = f"set {data_set} (true {DATA_SETS[data_set]:g} N)"
        table += paper_rows(dataset.sel(data_set=data_set), name, *PAPER[data_set])
    return table + verdict_rows(dataset)


EXPERIMENT = Experiment(
    name="reduced_data_set",
    question="what is left of an estimate on the last fifth of a record?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("data_set",),
    common_records=True,
    details=lambda dataset: detail_rows(dataset, tuple(LEVELS)),
)

if __name__ == "__main__":
    main(EXPERIMENT)
