"""MF4 (ASAM MDF) files."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_mf4"]


def read_mf4(path: Path) -> Table:
    """Read the numeric channels of an MDF file, each with its own time stamps.

    Parameters
    ----------
    path : Path
        The file.
    """
    asammdf = optional_package("asammdf", path)
    try:
        with asammdf.MDF(path) as file:
            signals = [signal for signal in file.iter_channels() if _is_vector(signal.samples)]
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not an MDF file ({error})", "give the suffix of its format"
        ) from None
    return Table(
        {
            signal.name: Column(
                partial(np.asarray, signal.samples),
                unit=signal.unit or None,
                clock=partial(np.asarray, signal.timestamps),
            )
            for signal in signals
        }
    )


def _is_vector(samples: NDArray[Any]) -> bool:
    return samples.ndim == 1 and samples.dtype.kind in "fiu"
