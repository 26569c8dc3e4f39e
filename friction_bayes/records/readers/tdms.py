"""TDMS files of LabVIEW."""

from __future__ import annotations

from functools import partial
from pathlib import Path

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
    except (ValueError, KeyError, OSError) as error:
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
                clock=channel.time_track if "wf_increment" in channel.properties else None,
            )
    return Table(columns)
