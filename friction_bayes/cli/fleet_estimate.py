"""``estimate`` of a fleet: one Zarr store in, one out."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from friction_bayes.cli.fleet_run import Fleet, FleetPart, finished_parts, fleet_manifest, rows_of
from friction_bayes.cli.options import key_values, system_of
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import write_whole
from friction_bayes.core.strict_json import strict_json
from friction_bayes.core.system import Oscillator
from friction_bayes.records.readers.netcdf import open_zarr_group

__all__ = ["estimate_fleet"]

_MANIFEST = "manifest"
"""Attribute of a result."""
_TOGETHER = 256
"""Parts in a chunk of the result."""


def estimate_fleet(arguments: argparse.Namespace, fleet: Fleet) -> dict[str, Any]:
    """Estimate every record into the Zarr store ``--out``, and return how many ended how.

    Raises
    ------
    InputError
        If the result cannot go there, or an option does not fit the fleet.
    """
    target = Path(arguments.out).absolute()
    _check_target(target, arguments)
    system = system_of(arguments)
    options = {
        "method": arguments.method,
        "prior": key_values(arguments.prior, "--prior"),
        "peaks": arguments.peaks,
        "random_force": arguments.random_force,
    }
    records = fleet.open()
    # what is refused of every record is refused now
    fb.estimate_batch(records[:0], system, **options)
    work = partial(_estimate_part, fleet=fleet, system=system, options=options)
    with finished_parts("estimate", arguments, fleet, rows_of(fleet, records), work, ".nc") as files:
        made = strict_json(fleet_manifest("estimate", arguments, fleet), indent=None)
        store = files[0].with_name(target.name)
        counts = _written(files, store, {_MANIFEST: made})
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists():
            target.rename(store.with_name("earlier"))
        store.rename(target)
    return counts


def _check_target(target: Path, arguments: argparse.Namespace) -> None:
    place = f"--out {arguments.out}"
    if target.suffix.lower() != ".zarr":
        raise InputError(place, "is no Zarr store", "give a name that ends in .zarr")
    if not target.exists():
        return
    if not arguments.force:
        raise InputError(place, "already exists", "choose another name or add --force")
    if _MANIFEST not in open_zarr_group(target).attrs:
        raise InputError(place, "is no result of estimate, and is not replaced", "choose another name")


def _estimate_part(part: FleetPart, *, fleet: Fleet, system: Oscillator, options: Mapping[str, Any]) -> None:
    which, file = part
    lazy = fb.estimate_batch(fleet.open()[which], system, **options)
    # block after block, in this thread: a worker has no room for more
    estimates = lazy.compute(scheduler="sync")
    write_whole(file, lambda path: estimates.to_netcdf(path, engine="h5netcdf"))


def _written(files: Sequence[Path], store: Path, attributes: Mapping[str, str]) -> dict[str, Any]:
    """Write what was kept into one Zarr store, some parts at a time."""
    status: Counter[str] = Counter()
    warned: Counter[str] = Counter()
    mode: Any = "w"
    for begin in range(0, len(files), _TOGETHER):
        parts = [xr.load_dataset(file, engine="h5netcdf") for file in files[begin : begin + _TOGETHER]]
        first = str(parts[0]["status"].dims[0])
        rows = xr.concat(parts, first, data_vars="minimal", coords="minimal", compat="override", join="exact")
        status.update(_meanings(rows["status"], "flag_values", np.equal))
        warned.update(_meanings(rows["warnings"], "flag_masks", np.bitwise_and))
        new: dict[str, Any] = {"append_dim": first}
        if mode == "w":
            along = {name: each for name, each in rows.variables.items() if first in each.dims}
            new = {"encoding": {name: {"chunks": each.shape} for name, each in along.items()}}
        rows.assign_attrs(attributes).to_zarr(store, mode=mode, zarr_format=2, consolidated=True, **new)
        mode = "a"
    return {"records": status.total(), "status": dict(+status), "warnings": dict(+warned)}


def _meanings(flags: xr.DataArray, which: str, has: np.ufunc) -> dict[str, int]:
    """In how many records each flag is set."""
    words = flags.attrs["flag_meanings"].split()
    flag = flags.attrs[which]
    return {
        word: int(np.count_nonzero(has(flags.values, each))) for word, each in zip(words, flag, strict=True)
    }
