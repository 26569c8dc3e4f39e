"""The records of a fleet in Zarr: many machines at many detection points, left on disk."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES, quantity_named, to_si
from friction_bayes.records.readers.netcdf import open_zarr_group

__all__ = ["open_fleet"]

_DIMENSIONS = 3


def open_fleet(path: Path) -> xr.DataArray | None:
    """Open the records of a fleet lazily, in SI units.

    Parameters
    ----------
    path : Path
        A Zarr group with one variable over machine, point and ``time``; its attribute ``quantity``, or its
        name, says what was measured, ``units`` in which unit.

    Returns
    -------
    xarray.DataArray or None
        None where the group holds single records only.

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
    if records.ndim != _DIMENSIONS or "time" not in records.dims:
        raise InputError(place, f"dimensions {records.dims}", "give (machine, point, time)")
    quantity = quantity_named(
        records.attrs.get("quantity", name if name in QUANTITIES else ""),
        place=f"{place}: attribute quantity",
    )
    if "units" not in records.attrs:
        raise InputError(place, "does not say its unit", f"set its attribute units, such as {quantity.unit}")
    factor, unit = to_si(quantity, records.attrs["units"], place=f"{place}: attribute units")
    if "time" not in records.coords:
        raise InputError(place, "has no coordinate time", "add the sample times in seconds")
    scaled = records if factor == 1.0 else records * factor
    return scaled.assign_attrs(records.attrs | {"quantity": quantity.name, "units": unit})
