"""NetCDF and Zarr through xarray: records that were saved, and any variable over one dimension."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.hdf5 import hdf5_vectors
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table

__all__ = ["open_zarr_group", "read_netcdf", "read_zarr"]


def read_netcdf(path: Path) -> Table:
    """Read the one-dimensional variables of a NetCDF file (classic or 4).

    Parameters
    ----------
    path : Path
        The file.
    """
    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    if not classic:
        # version 4 is HDF5; which dimensions its variables share is of no use here
        vectors = [vector for vector in hdf5_vectors(path, "a NetCDF file") if "/" not in vector.name]
        raw = {name: (f"samples of {name}", values, attrs) for name, attrs, values in vectors}
    try:
        # times are numbers of seconds here, and stay so
        dataset = (
            xr.load_dataset(path, engine="scipy", decode_times=False)
            if classic
            else xr.decode_cf(xr.Dataset(raw), decode_times=False)
        )
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a NetCDF file ({error})", "give the suffix of its format"
        ) from None
    return _table(dataset)


def read_zarr(path: Path) -> Table:
    """Read the one-dimensional variables of a Zarr group.

    Parameters
    ----------
    path : Path
        The folder.
    """
    dataset = open_zarr_group(path, load=True)
    fleets = [str(name) for name, variable in dataset.data_vars.items() if variable.ndim > 1]
    if fleets and not any(variable.ndim == 1 for variable in dataset.data_vars.values()):
        raise InputError(
            str(path),
            f"{fleets[0]} holds many records",
            "select one record, or give it alone to estimate, close-loop or monitor",
        )
    return _table(dataset)


def open_zarr_group(path: Path, *, load: bool = False) -> xr.Dataset:
    """Open a Zarr group, its arrays left on disk or read at once.

    Raises
    ------
    InputError
        If it is not a Zarr group.
    """
    optional_package("zarr", path)
    try:
        # without Dask, whose chunks are those of the store then: fleets choose their own
        dataset = xr.open_zarr(path, decode_times=False, consolidated=False, chunks=None)
        return dataset.load() if load else dataset
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a Zarr group ({error})", "give a folder written by Zarr"
        ) from None


def _table(dataset: xr.Dataset) -> Table:
    columns = {}
    for name, variable in dataset.variables.items():
        if variable.ndim != 1 or variable.dtype.kind not in "fiu":
            continue
        attrs = {key: v.item() if isinstance(v, np.generic) else v for key, v in variable.attrs.items()}
        quantity, unit = attrs.pop("quantity", None), attrs.pop("units", attrs.pop("unit", None))
        if "synthetic" in attrs:
            attrs["synthetic"] = bool(attrs["synthetic"])
        columns[str(name)] = Column(
            partial(np.asarray, variable.values),
            quantity=quantity,
            unit=unit or ("s" if name == "time" else None),
            attrs=attrs if quantity else {},
        )
    return Table(columns)
