"""TDMS files of LabVIEW."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_tdms"]


def read_tdms(path: Path) -> Table:
    """Read the numeric channels of a TDMS file, named ``group/channel``, with waveform timing if it has any.

    Parameters
    ----------
    path : Path
        The file.
    """
    nptdms = optional_package("nptdms", path)
    try:
        file = nptdms.TdmsFile.read(path)
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a TDMS file ({error})", "give the suffix of its format"
        ) from None
    columns = {}
    for group in file.groups():
        for channel in group.channels():
            if channel.dtype.kind not in "fiu":
                continue
            columns[f"{group.name}/{channel.name}"] = Column(
                partial(channel.__getitem__, slice(None)),
                unit=channel.properties.get("unit_string") or None,
                clock=_clock(channel.properties, len(channel)),
            )
    return Table(columns)


def _clock(properties: Mapping[str, Any], samples: int) -> Callable[[], Array] | None:
    """Return the times of a waveform, None for other channels; LabVIEW leaves an offset of zero out."""
    if "wf_increment" not in properties:
        return None
    return lambda: properties.get("wf_start_offset", 0.0) + properties["wf_increment"] * np.arange(samples)
