"""Plain HDF5: every numeric one-dimensional data set, by its path in the file.

Read in a process of their own: a damaged file can lead the library round without end.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.own_process import arrays_read_by, write_arrays_of
from friction_bayes.records.readers.table import Column, Table

__all__ = ["Hdf5Vector", "hdf5_vectors", "read_hdf5"]


class Hdf5Vector(NamedTuple):
    """A numeric data set of one dimension, or of one that is longer than 1.

    Attributes
    ----------
    name : str
        Its path in the file.
    attrs : dict
        Those of its attributes that are one number or text.
    values : ndarray, shape (n,)
    """

    name: str
    attrs: dict[str, Any]
    values: NDArray[Any]


def read_hdf5(path: Path) -> Table:
    """Read the vectors of an HDF5 file; with the attributes ``quantity`` and ``units`` (or ``unit``) of each.

    Parameters
    ----------
    path : Path
        The file.
    """
    return Table(
        {
            vector.name: Column(
                partial(np.asarray, vector.values),
                quantity=_text(vector.attrs.get("quantity")),
                unit=_text(vector.attrs.get("units", vector.attrs.get("unit"))),
                attrs={"synthetic": True} if vector.attrs.get("synthetic") else {},
            )
            for vector in hdf5_vectors(path, "an HDF5 file")
        }
    )


def hdf5_vectors(path: Path, format_name: str) -> list[Hdf5Vector]:
    """Read the vectors of a file that is HDF5.

    Parameters
    ----------
    path : Path
        The file.
    format_name : str
        What it is said not to be, with its article, where that fails.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    import h5py

    # a text, say, needs no process to be recognised
    if not h5py.is_hdf5(path):
        raise InputError(
            str(path), f"this is not {format_name} (it begins otherwise)", "give the suffix of its format"
        )
    arrays = arrays_read_by(__name__, path, format_name)
    listed = json.loads(str(arrays["listed"]))
    return [Hdf5Vector(name, attrs, arrays[f"vector{k}"]) for k, (name, attrs) in enumerate(listed)]


def _vectors(path: str) -> dict[str, NDArray[Any]]:
    """The vectors of a file, their names and attributes."""
    import h5py

    listed: list[tuple[str, dict[str, Any]]] = []
    vectors: dict[str, NDArray[Any]] = {}

    def collect(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiu":
            return
        if item.size < 2 or item.size != max(item.shape):
            return
        vectors[f"vector{len(listed)}"] = np.asarray(item).ravel()
        stated = {key: np.asarray(item.attrs[key]) for key in item.attrs if key not in _SCALES}
        plain = {key: value.item() for key, value in stated.items() if value.size == 1}
        texts = {key: _text(value) for key, value in plain.items() if isinstance(value, str | bytes)}
        numbers = {key: value for key, value in plain.items() if isinstance(value, int | float)}
        listed.append((name, texts | numbers))

    with h5py.File(path) as file:
        file.visititems(collect)
    return vectors | {"listed": np.array(json.dumps(listed))}


_SCALES = ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates")
"""Attributes by which NetCDF ties dimensions to variables."""


def _text(value: Any) -> str | None:
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return value if isinstance(value, str) else None


if __name__ == "__main__":
    write_arrays_of(_vectors)
