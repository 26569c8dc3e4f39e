"""Fleets of small machines as Zarr stores, and what a run over one left."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr

__all__ = ["numbers_of", "write_fleet"]


def write_fleet(path: Path, records: Sequence[Sequence[xr.DataArray]]) -> xr.DataArray:
    """Write records by machine and point, one machine a chunk."""
    machines = ["a" * (m + 1) for m in range(len(records))]
    array = xr.DataArray(
        np.array([[record.values for record in row] for row in records]),
        dims=("machine", "point", "time"),
        coords={
            "time": records[0][0]["time"].values,
            "machine": machines,
        },
        attrs={"units": "m"},
    )
    dataset = array.to_dataset(name="displacement").chunk({"machine": 1})
    dataset.to_zarr(path, mode="w", consolidated=False, zarr_format=2)
    return array


def numbers_of(out: Path) -> dict[str, bytes]:
    """All files that a run left but those that say when it was made."""
    dated = {"manifest.json", "noise_sweep.json", "report.html", ".zattrs", ".zmetadata"}
    files = [path for path in out.rglob("*") if path.is_file() and path.name not in dated]
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}
