"""Plain HDF5: every numeric one-dimensional data set, by its path in the file."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_hdf5"]


def read_hdf5(path: Path) -> Table:
    """Read the vectors of an HDF5 file; attributes ``quantity`` and ``units`` of a data set are used.

    Parameters
    ----------
    path : Path
        The file.
    """
    import h5py

    columns: dict[str, Column] = {}

    def collect(name: str, item: Any) -> None:
        if (
            not isinstance(item, h5py.Dataset)
            or item.dtype.kind not in "fiu"
            or max(item.shape, default=0) < 2
        ):
            return
        if item.size == max(item.shape):
            columns[name] = Column(
                partial(_vector, path, name),
                quantity=_text(item.attrs.get("quantity")),
                unit=_text(item.attrs.get("units")),
                attrs={"synthetic": True} if item.attrs.get("synthetic") else {},
            )

    try:
        with h5py.File(path) as file:
            file.visititems(collect)
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not an HDF5 file ({error})", "give the suffix of its format"
        ) from None
    return Table(columns)


def _vector(path: Path, name: str) -> NDArray[Any]:
    import h5py

    try:
        with h5py.File(path) as file:
            return np.asarray(file[name]).ravel()
    except Exception as error:  # parts of a data set are compressed and checked each by itself
        raise InputError(
            str(path), f"{name} cannot be read ({error})", "the file is damaged: export it again"
        ) from None


def _text(value: Any) -> str | None:
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return value if isinstance(value, str) else None
