"""MF4 (ASAM MDF) files, read in a process of their own: a damaged one can crash the library."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.own_process import arrays_read_by, write_arrays_of
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_mf4"]

_SIGNATURES = (b"MDF ", b"UnFinMF ")
"""Of a file that is finished, and of one that was still being written."""


def read_mf4(path: Path) -> Table:
    """Read the numeric channels of an MDF file, each with its own time stamps, of one name as ``0/name``, ...

    Parameters
    ----------
    path : Path
        The file.
    """
    optional_package("asammdf", path)
    with path.open("rb") as file:
        known = file.read(8).startswith(_SIGNATURES)
    if not known:
        raise InputError(
            str(path), "this is not an MDF file (it begins otherwise)", "give the suffix of its format"
        )
    arrays = arrays_read_by(__name__, path, "an MDF file")
    channels = json.loads(str(arrays["channels"]))
    names = [name for name, _ in channels]
    # groups may have channels of one name
    names = [
        f"{names[:k].count(name)}/{name}" * (names.count(name) > 1) or name for k, name in enumerate(names)
    ]
    return Table(
        {
            name: Column(
                partial(np.asarray, arrays[f"samples{k}"]),
                unit=unit or None,
                clock=partial(np.asarray, arrays[f"times{k}"]),
            )
            for k, (name, (_, unit)) in enumerate(zip(names, channels, strict=True))
        }
    )


def _channels(path: str) -> dict[str, NDArray[Any]]:
    """The channels of a file, their names and units."""
    import asammdf

    with asammdf.MDF(path) as file:
        signals = [signal for signal in file.iter_channels() if _is_vector(signal.samples)]
    arrays = {f"samples{k}": signal.samples for k, signal in enumerate(signals)}
    arrays |= {f"times{k}": signal.timestamps for k, signal in enumerate(signals)}
    return arrays | {"channels": np.array(json.dumps([(signal.name, signal.unit) for signal in signals]))}


def _is_vector(samples: NDArray[Any]) -> bool:
    return samples.ndim == 1 and samples.dtype.kind in "fiu"


if __name__ == "__main__":
    write_arrays_of(_channels)
