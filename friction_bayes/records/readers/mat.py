"""MATLAB files: variables, cells and struct members by path, such as ``Y[0][1]`` or ``Theta.values``.

They are read in a process of their own: a damaged one can crash the library.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.hdf5 import read_hdf5
from friction_bayes.records.readers.own_process import arrays_read_by, write_arrays_of
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_mat"]

_IS_HDF5 = 2
"""Version of files that are HDF5."""


def read_mat(path: Path) -> Table:
    """Read every numeric vector of a MAT file.

    Cells are counted from zero, ``name[i]``, and so are the channels of a matrix, along its shorter side;
    the index of a single cell or struct is left out. Files of version 7.3 are read as the HDF5 they are.

    Parameters
    ----------
    path : Path
        The file.
    """
    from scipy.io.matlab import matfile_version

    try:
        version, _ = matfile_version(path)
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a MAT file ({error})", "give a file saved by MATLAB"
        ) from None
    if version == _IS_HDF5:
        return read_hdf5(path)
    arrays = arrays_read_by(__name__, path, "a MAT file")
    names = json.loads(str(arrays["names"]))
    return Table({name: Column(partial(np.asarray, arrays[f"vector{k}"])) for k, name in enumerate(names)})


def _named_vectors(path: str) -> dict[str, NDArray[Any]]:
    """The numeric vectors of a file, and their names."""
    from scipy.io import loadmat

    named = {
        leaf: vector
        for name, value in loadmat(path).items()
        if not name.startswith("__")
        for leaf, vector in _vectors(name, value)
    }
    vectors = {f"vector{k}": vector for k, vector in enumerate(named.values())}
    return vectors | {"names": np.array(json.dumps(list(named)))}


def _vectors(name: str, value: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Walk a variable down to its numeric vectors."""
    array = np.asarray(value)
    if array.dtype.names:
        for index, struct in enumerate(array.ravel()):
            for member in array.dtype.names:
                yield from _vectors(f"{_indexed(name, index, array.size)}.{member}", struct[member])
    elif array.dtype == object:
        for index, cell in enumerate(array.ravel()):
            yield from _vectors(_indexed(name, index, array.size), cell)
    elif array.dtype.kind in "fiu" and array.ndim <= 2 and array.size > 1:
        channels = np.atleast_2d(array)
        if channels.shape[0] > channels.shape[1]:
            channels = channels.T
        for index, channel in enumerate(channels):
            yield _indexed(name, index, len(channels)), channel


def _indexed(name: str, index: int, size: int) -> str:
    return name if size == 1 else f"{name}[{index}]"


if __name__ == "__main__":
    write_arrays_of(_named_vectors)
