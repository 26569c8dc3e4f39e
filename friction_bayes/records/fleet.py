"""The records of a fleet in Zarr: many of one kind of machine, left on disk."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES, TIME_UNITS, quantity_named, to_si
from friction_bayes.records.clock import in_time_unit
from friction_bayes.records.readers.netcdf import open_zarr_group

__all__ = ["open_fleet"]

_BLOCK_BYTES = 2**27
"""Of a block of records, as they lie in the store, unless one of its chunks has more."""


def open_fleet(path: Path, blocks: Mapping[str, int] | None = None) -> xr.DataArray | None:
    """Open the records of a fleet lazily, in SI units.

    Parameters
    ----------
    path : Path
        A Zarr group with one variable over ``time`` and others, such as machine and point; its attribute
        ``quantity``, or its name, says what was measured, ``units`` in which unit.
    blocks : mapping of str to int, optional
        Records read at once, by dimension; whole chunks of the store when left out.

    Returns
    -------
    xarray.DataArray or None
        Over ``time`` last, with a coordinate over each of its dimensions. None where the group holds single
        records only.

    Raises
    ------
    InputError
        If it is not a Zarr group, holds several such variables, or one of unknown quantity or unit.
    """
    dataset = open_zarr_group(path)
    arrays = {str(name): array for name, array in dataset.data_vars.items() if array.ndim > 1}
    if not arrays:
        return None
    if len(arrays) > 1:
        raise InputError(str(path), f"holds {', '.join(arrays)}", "keep one variable with records")
    name, records = next(iter(arrays.items()))
    place = f"{path}: {name}"
    if "time" not in records.dims:
        raise InputError(place, f"dimensions {records.dims}", "give (record, time) or (machine, point, time)")
    quantity = quantity_named(
        records.attrs.get("quantity", name if name in QUANTITIES else ""),
        place=f"{place}: attribute quantity",
    )
    if "units" not in records.attrs:
        raise InputError(place, "does not say its unit", f"set its attribute units, such as {quantity.unit}")
    factor, unit = to_si(quantity, records.attrs["units"], place=f"{place}: attribute units")
    if "time" not in records.coords:
        raise InputError(place, "has no coordinate time", "add the sample times in seconds")
    time = records["time"]
    seconds = TIME_UNITS[in_time_unit(place, "coordinate time", str(time.attrs.get("units", "s")))]
    records = records.assign_coords(time=(seconds * time).assign_attrs(units="s"))
    lazy = records.chunk({"time": -1} | dict(blocks or _blocks(records))).transpose(..., "time")
    counted = {name: np.arange(n) for name, n in lazy.sizes.items() if name not in lazy.coords}
    scaled = lazy if factor == 1.0 else lazy * factor
    return scaled.assign_coords(counted).assign_attrs(
        records.attrs | {"quantity": quantity.name, "units": unit}
    )


def _blocks(records: xr.DataArray) -> dict[str, int]:
    """Numbers of records along each dimension but time that are read at once: whole chunks of the store."""
    stored = records.encoding["preferred_chunks"]
    sizes = {str(name): int(stored[name]) for name in records.dims if name != "time"}
    record = records.dtype.itemsize * records.sizes["time"]
    for name in reversed(sizes):
        sizes[name] *= max(_BLOCK_BYTES // max(record * math.prod(sizes.values()), 1), 1)
        sizes[name] = min(sizes[name], records.sizes[name])
    return sizes
