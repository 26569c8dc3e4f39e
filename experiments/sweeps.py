"""Sweeps of the closed forms over levels: their cells, their seeds, and the dataset they are gathered in."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_emcee import CHECKED
from experiments.closed_forms import METHODS, VARIABLES
from experiments.runner import Cell

__all__ = ["SweepConfig", "gather", "lay_out", "seeds_of", "sweep_cells"]


@dataclass(frozen=True)
class SweepConfig:
    """Records a level (with ``--full``; at levels of the paper), how many go through emcee, methods."""

    records: int = 40
    records_full: int = 400
    records_paper: int = 200
    checked: int = CHECKED
    methods: tuple[str, ...] = tuple(METHODS)


def sweep_cells(
    levels: Mapping[str, Sequence[Any]],
    config: SweepConfig,
    full: bool,
    *,
    of_paper: Callable[[Mapping[str, Any]], bool] = lambda known: True,
) -> list[dict[str, Any]]:
    """Return the cells of all combinations of levels, those with a sampler first since they take longest.

    Parameters
    ----------
    levels : mapping
        Values by name.
    config : SweepConfig
    full : bool
        Whether to take as many records as ``--full`` takes.
    of_paper : callable
        Whether the paper has a number for a combination; those have more records.
    """
    combinations = [dict(zip(levels, values, strict=True)) for values in product(*levels.values())]

    def records(known: Mapping[str, Any]) -> int:
        if full:
            return config.records_full
        return max(config.records_paper, config.records) if of_paper(known) else config.records

    return [
        known | {"replicate": replicate, "check": replicate < config.checked}
        for replicate in range(max(records(known) for known in combinations))
        for known in combinations
        if replicate < records(known)
    ]


def seeds_of(cell: Cell, seed: np.random.SeedSequence) -> tuple[int, int]:
    """Return the seed of the noise, shared by paired cells, and that of the sampler, the cell's own."""
    of_noise = int(seed.generate_state(1)[0])
    own = zlib.crc32(json.dumps(dict(cell), sort_keys=True).encode())
    return of_noise, int(np.random.SeedSequence([of_noise, own]).generate_state(1)[0])


def gather(
    cells: Sequence[Cell], results: Sequence[Mapping[str, Any]], *, levels: Mapping[str, str]
) -> xr.Dataset:
    """Lay the cells of a sweep out over levels, replicates and methods.

    Parameters
    ----------
    cells, results : sequences
        As the runner hands them over.
    levels : mapping
        Unit of each swept coordinate, by name.

    Returns
    -------
    xarray.Dataset
        Dimensions: the levels, ``replicate`` and ``method``; the names of :data:`VARIABLES`.
    """
    inner = {"method": results[0]["method"]}
    dataset = lay_out(cells, results, dims=(*levels, "replicate"), variables=VARIABLES, inner=inner)
    for name, unit in levels.items():
        dataset[name].attrs["units"] = unit
    return dataset


def lay_out(
    cells: Sequence[Cell],
    results: Sequence[Mapping[str, Any]],
    *,
    dims: Sequence[str],
    variables: Mapping[str, tuple[str, str]],
    inner: Mapping[str, Sequence[Any]] | None = None,
) -> xr.Dataset:
    """Lay numbers out over the coordinates of their cells, nan where there is no cell.

    Parameters
    ----------
    cells, results : sequences
        As the runner hands them over.
    dims : sequence of str
        Keys of the cells that become dimensions.
    variables : mapping
        Unit and meaning by name; each a key of every result.
    inner : mapping, optional
        Coordinates of further dimensions, along which every result holds a flat list in C order.

    Returns
    -------
    xarray.Dataset
        Dimensions: ``dims``, then those of ``inner``.
    """
    within = {} if inner is None else {name: list(values) for name, values in inner.items()}
    coordinates = {name: list(dict.fromkeys(cell[name] for cell in cells)) for name in dims}
    tail = tuple(len(values) for values in within.values())
    shape = (*(len(values) for values in coordinates.values()), *tail)
    columns = {name: np.full(shape, np.nan) for name in variables}
    for cell, result in zip(cells, results, strict=True):
        where = tuple(coordinates[name].index(cell[name]) for name in dims)
        for name, column in columns.items():
            # a number that was not finite is null in a cell's file
            column[where] = np.array(result[name], dtype=np.float64).reshape(tail)
    return xr.Dataset(
        {
            name: ((*coordinates, *within), columns[name], {"units": unit, "long_name": meaning})
            for name, (unit, meaning) in variables.items()
        },
        coords=coordinates | within,
        attrs={"synthetic": 1},
    )
