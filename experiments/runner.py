"""Run an experiment: spread its cells over workers, resume what was interrupted, save, tabulate.

A cell is a pure function of its settings and its own seed: lost ones are redone with the same bits.
Cells wait as small files next to the result until all are there; then they become one dataset, a manifest
and a page of tables. The name of such a file has the digest of the sources that computed it, so that cells
of two versions of the code never meet in one dataset.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

import friction_bayes
from experiments.against_emcee import what_was_checked
from experiments.sources import commit, sources_digest
from experiments.tables import Row, closing_table, page
from friction_bayes.core.blas import single_threaded_blas
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import manifest, settings_key, write_json, write_whole
from friction_bayes.core.workers import for_each

__all__ = [
    "Cell",
    "Experiment",
    "Row",
    "main",
    "parser_for",
    "run_experiment",
    "settings_digest",
    "tables",
]

Cell = Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """One question, answered by many independent cells.

    Attributes
    ----------
    name : str
        Module name; results go to ``results/NAME.nc``.
    question : str
        The question in one sentence.
    config : dataclass
        Frozen settings; they and the seed determine every number.
    cells : callable, (config, full) -> sequence of dict
        Coordinates of every cell; JSON-able values.
    run : callable, (config, cell, SeedSequence) -> dict
        The numbers of one cell: floats, or flat lists of them.
    assemble : callable, (list of cells, list of results) -> xarray.Dataset
        Gathers the cells into one dataset with named dimensions.
    rows : callable, Dataset -> sequence of Row
        The closing table.
    heading : str
        Of the column that ours is compared with.
    group : {"paper", "blind", "measured", "own"}
        What it belongs to: the paper and its pages, sealed synthetic records, measured ones, which must be at
        hand, or checks of this package's own methods.
    paired : tuple of str
        Coordinates that a cell's seed does not depend on: cells that differ in these alone see the
        same noise. Which cells go through emcee never counts.
    common_records : bool
        Whether its records are shared by all experiments with this flag: a cell's seed then follows from
        the root seed and the cell alone, so that one condition gives one result in every experiment.
    details : callable, Dataset -> sequence of mappings, optional
        A second table, for ``results/NAME.md``: text by column heading, the same columns in every line.
    """

    name: str
    question: str
    config: Any
    cells: Callable[[Any, bool], Sequence[Cell]]
    run: Callable[[Any, Cell, np.random.SeedSequence], dict[str, Any]]
    assemble: Callable[[Sequence[Cell], Sequence[dict[str, Any]]], xr.Dataset]
    rows: Callable[[xr.Dataset], Sequence[Row]]
    heading: str = "paper"
    group: str = "paper"
    paired: tuple[str, ...] = ()
    common_records: bool = False
    details: Callable[[xr.Dataset], Sequence[Mapping[str, str]]] | None = None


PACKED = {"zlib": True, "complevel": 9}
"""How numbers are written: compressed, without a loss."""
_CHECKING, _CHECKED = ("check", "check_forced"), ("checked", "checked_forced")
"""Coordinates and settings that say which records go through emcee: they change no record."""


def _key(name: str, config: Mapping[str, Any], cell: Cell, seed: int) -> str:
    """Digest of the settings of a cell, the same whatever the sources."""
    return settings_key([name, dict(config), dict(cell), seed, friction_bayes.__version__])


def _cell_seed(experiment: Experiment, cell: Cell, seed: int) -> np.random.SeedSequence:
    """Seed sequence of one cell, the same wherever and in whatever order it runs."""
    own = _without(cell, (*experiment.paired, *_CHECKING))
    if experiment.common_records:
        return np.random.SeedSequence(int(settings_key([own, seed, friction_bayes.__version__]), 16))
    config = _without(asdict(experiment.config), _CHECKED)
    return np.random.SeedSequence(int(_key(experiment.name, config, own, seed), 16))


def _without(named: Mapping[str, Any], left_out: Sequence[str]) -> dict[str, Any]:
    return {name: value for name, value in named.items() if name not in left_out}


@single_threaded_blas()
def _run_cell(item: tuple[Cell, Path], *, experiment: Experiment, seed: int) -> None:
    """Run one cell on one core, so that its times are those of one core and workers do not fight for them."""
    cell, target = item
    numbers = experiment.run(experiment.config, cell, _cell_seed(experiment, cell, seed))
    write_whole(target, lambda path: write_json(path, numbers))


def _compute(
    experiment: Experiment, missing: Sequence[tuple[Cell, Path]], options: argparse.Namespace
) -> None:
    """Run the missing cells, showing how many are done."""
    console = Console(stderr=True)
    columns = (TextColumn("cells"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        bar = progress.add_task("cells", total=len(missing))
        for_each(
            partial(_run_cell, experiment=experiment, seed=options.seed),
            missing,
            scheduler=options.scheduler,
            workers=options.workers,
            done=lambda: progress.advance(bar),
        )


def parser_for(program: str, description: str) -> argparse.ArgumentParser:
    """Return the options that every experiment takes."""
    parser = argparse.ArgumentParser(prog=program, description=description)
    parser.add_argument("--full", action="store_true", help="more seeds and finer steps; resumable")
    parser.add_argument("--seed", type=int, default=20210607, help="root seed (default %(default)s)")
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, help="worker processes (default: one a core)"
    )
    parser.add_argument("--scheduler", help="address of a dask.distributed scheduler, tcp://...")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    return parser


def settings_digest(experiment: Experiment, options: argparse.Namespace) -> str:
    """Digest of all that a result depends on: settings, seed, cells, and the sources that compute it."""
    cells = experiment.cells(experiment.config, options.full)
    return hashlib.sha256("".join(_cell_names(experiment, cells, options.seed)).encode()).hexdigest()


def _cell_names(experiment: Experiment, cells: Sequence[Cell], seed: int) -> list[str]:
    """Names of the files that cells wait in: digests of all that their numbers depend on."""
    sources = sources_digest(experiment.name)
    config = asdict(experiment.config)
    keys = [_key(experiment.name, config, cell, seed) for cell in cells]
    return [f"{settings_key([key, sources])}.json" for key in keys]


def _processor_seconds() -> float:
    """Processor time [s] of this process and of its workers that have ended."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def main(experiment: Experiment, argv: Sequence[str] | None = None) -> xr.Dataset:
    """Run an experiment from the command line and return its dataset.

    Parameters
    ----------
    experiment : Experiment
        What to run.
    argv : sequence of str, optional
        Options; ``sys.argv[1:]`` when left out.

    Returns
    -------
    xarray.Dataset
        The same as saved to ``results/NAME.nc``.
    """
    parser = parser_for(f"python -m experiments.{experiment.name}", experiment.question)
    return run_experiment(experiment, parser.parse_args(argv))


def _check_unchanged(experiment: Experiment, options: argparse.Namespace, digest: str) -> None:
    """Refuse where the sources are no longer those that were loaded: keys would name what did not compute."""
    if settings_digest(experiment, options) != digest:
        raise InputError(
            f"the sources of {experiment.name}", "changed while the program ran", "start it once more"
        )


def tables(experiment: Experiment, dataset: xr.Dataset) -> tuple[list[Row], str]:
    """Return the closing table of an experiment, and in Markdown what a sampler checked and all tables.

    Parameters
    ----------
    experiment : Experiment
    dataset : xarray.Dataset
        Its result, as computed or as read from ``NAME.nc``.
    """
    rows = list(experiment.rows(dataset))
    details = [] if experiment.details is None else list(experiment.details(dataset))
    return rows, f"{what_was_checked(dataset)}\n\n{page(rows, details, heading=experiment.heading)}"


def run_experiment(
    experiment: Experiment, options: argparse.Namespace, digest: str | None = None
) -> xr.Dataset:
    """Compute what is missing, save dataset, manifest and tables, print the closing table.

    Parameters
    ----------
    experiment : Experiment
        What to run.
    options : argparse.Namespace
        Of :func:`parser_for`.
    digest : str, optional
        Of :func:`settings_digest` when the program began; that of now when left out.

    Returns
    -------
    xarray.Dataset
        The same as saved to ``results/NAME.nc``.

    Raises
    ------
    InputError
        If the sources have changed since the program began or while the cells were computed. Those cells are
        thrown away.
    """
    started, used = time.perf_counter(), _processor_seconds()
    digest = digest or settings_digest(experiment, options)
    _check_unchanged(experiment, options, digest)
    cells = list(experiment.cells(experiment.config, options.full))
    # workers of a cluster may run in another folder
    waiting = options.results.absolute() / f"{experiment.name}.cells"
    waiting.mkdir(parents=True, exist_ok=True)
    files = [waiting / name for name in _cell_names(experiment, cells, options.seed)]
    missing = [(cell, file) for cell, file in zip(cells, files, strict=True) if not file.exists()]
    if len(missing) < len(cells):
        print(f"resuming: {len(cells) - len(missing)} of {len(cells)} cells are there", file=sys.stderr)
    _compute(experiment, missing, options)
    try:
        _check_unchanged(experiment, options, digest)
    except InputError:
        shutil.rmtree(waiting)
        raise

    results = [json.loads(file.read_text()) for file in files]
    dataset = experiment.assemble(cells, results)
    dataset.attrs.update(experiment=experiment.name, question=experiment.question, seed=options.seed)
    rows, text = tables(experiment, dataset)
    target = options.results / f"{experiment.name}.nc"
    packed = {name: PACKED for name, each in dataset.items() if each.dtype.kind in "fi" and each.ndim}
    write_whole(target, lambda path: dataset.to_netcdf(path, engine="h5netcdf", encoding=packed))
    write_whole(target.with_suffix(".md"), lambda path: path.write_text(text, encoding="utf-8"))
    seconds = time.perf_counter() - started
    record = manifest(
        f"python -m experiments.{experiment.name}",
        options={"config": asdict(experiment.config), "full": options.full, "cells": len(cells)},
        seed=options.seed,
    ) | {
        "elapsed_s": seconds,
        "processor_s": _processor_seconds() - used,
        "settings": digest,
        "sources": sources_digest(experiment.name),
        "commit": commit(),
        "group": experiment.group,
        "beside": experiment.heading,
        "table": [asdict(row) for row in rows],
    }
    write_whole(target.with_suffix(".json"), lambda path: write_json(path, record))
    shutil.rmtree(waiting)
    console = Console()
    console.print(
        closing_table(f"{experiment.name}: {experiment.question}", rows, heading=experiment.heading)
    )
    console.print(what_was_checked(dataset))
    console.print(f"{seconds:.0f} s; all in {target}, tables in {target.with_suffix('.md')}")
    return dataset
