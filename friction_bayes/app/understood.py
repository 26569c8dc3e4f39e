"""What is understood of a file: its columns, the record that is read from it, and a curve to look at."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.records.description import what_was_read
from friction_bayes.records.readers import read_table
from friction_bayes.records.readers.table import Table, meanings, record_from_table

__all__ = ["READING", "Understood", "curve", "in_words_of_the_page", "understand"]

READING = (
    "time_column",
    "signal_column",
    "quantity",
    "unit",
    "scale",
    "sampling_rate",
    "run",
    "skip_rows",
    "duplicates",
    "start",
    "end",
)
"""What may be said of a file: arguments of :func:`friction_bayes.read_record`, fields of the page."""
_FIELDS = re.compile(rf"--({'|'.join(name.replace('_', '-') for name in READING)})\b")
_MOST_DRAWN = 2000
"""Bins of a curve, of each of which the lowest and the highest sample are drawn."""


@dataclass(frozen=True, kw_only=True)
class Understood:
    """What was understood of a file.

    Attributes
    ----------
    columns : mapping of str to str
        What the file says of each column; empty where it cannot be read at all.
    record : xarray.DataArray or None
        What is taken of it; None where the columns do not make a record.
    whole : xarray.DataArray or None
        The same without ``start`` and ``end``, where that is a record too.
    problem : str
        Why there is none; empty where there is.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    record: xr.DataArray | None = None
    whole: xr.DataArray | None = None
    problem: str = ""

    @property
    def sentence(self) -> str:
        """What was understood, or what was not."""
        return self.problem if self.record is None else what_was_read(self.record)


def understand(path: Path, reading: Mapping[str, Any]) -> Understood:
    """Read a file as far as it goes; nothing is raised of what is wrong with it.

    Parameters
    ----------
    path : pathlib.Path
    reading : mapping
        Arguments of :func:`friction_bayes.read_record`.
    """
    choices = dict(reading)
    columns: dict[str, str] = {}
    whole = None
    try:
        table = read_table(path, skip_rows=choices.pop("skip_rows", 0))
        columns = meanings(table)
        if choices.keys() & {"start", "end"}:
            whole = _without_limits(table, path.name, choices)
        record = record_from_table(table, place=path.name, **choices)
    except InputError as error:
        problem = in_words_of_the_page(error.for_command_line, path)
        return Understood(columns=columns, whole=whole, problem=problem)
    return Understood(columns=columns, record=record, whole=record if whole is None else whole)


def _without_limits(table: Table, place: str, choices: Mapping[str, Any]) -> xr.DataArray | None:
    """The whole of a record; None where what lies outside of the limits makes it none."""
    try:
        return record_from_table(table, place=place, **{**choices, "start": None, "end": None})
    except InputError:
        return None


def in_words_of_the_page(message: str, path: Path) -> str:
    """Write a message with the page's fields in the place of options, and a file without its folder."""
    named = _FIELDS.sub(lambda option: f"“{option[1].replace('-', ' ')}”", message)
    return named.replace(str(path), path.name)


def curve(record: xr.DataArray) -> tuple[Array, Array]:
    """Return times and samples to draw, of a long record the lowest and the highest of each bin.

    Parameters
    ----------
    record : xarray.DataArray

    Returns
    -------
    time, values : ndarray, shape (m,), m <= 4000
    """
    time, values = record["time"].values, record.values
    if values.size <= 2 * _MOST_DRAWN:
        return time, values
    edges = np.linspace(0, values.size, _MOST_DRAWN + 1).astype(int)
    ends = (np.argmin, np.argmax)
    kept = np.unique([low + end(values[low:high]) for low, high in pairwise(edges) for end in ends])
    return time[kept], values[kept]
