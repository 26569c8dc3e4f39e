"""Text tables: CSV and its relatives."""

from __future__ import annotations

import csv
import re
from functools import partial
from pathlib import Path

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_text"]

_QUOTED = re.compile(r"^'(.*)'$")
_SYNTHETIC = re.compile(r"#\s*synthetic\b")


def read_text(path: Path, *, skip_lines: int = 0) -> Table:
    """Read a text table of one header line, or none, and rows of numbers.

    Columns are separated by semicolons, tabs, commas or blanks (the first of these that the first line has).
    Lines that are blank or begin with ``#`` are passed over; a comment ``# synthetic`` marks the record.
    Empty cells at the top or the end of a column are no part of it: runs side by side differ in length.

    Parameters
    ----------
    path : Path
        The file: UTF-8, with or without a byte-order mark, UTF-16 with one, or Latin-1.
    skip_lines : int
        Lines to pass over at the top, whatever they hold.

    Raises
    ------
    InputError
        If a row has the wrong number of cells, or a cell that is not a number; names the row.
    """
    lines = _decode(path).splitlines()
    kept = [
        (row, line)
        for row, line in enumerate(lines, start=1)
        if row > skip_lines and line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise InputError(
            str(path), "the file holds no data", "give a file with a header line and rows of numbers"
        )
    separator = _separator(kept[0][1].strip())
    try:
        table = [(row, _cells(line, separator)) for row, line in kept]
    except csv.Error as error:
        raise InputError(
            str(path), f"this is no table ({error})", "give a file with rows of numbers"
        ) from None
    if all(_is_number(cell) for cell in table[0][1]):
        names = [str(k) for k in range(len(table[0][1]))]
    else:
        names = _header(path, table.pop(0)[1])
    if not table:
        raise InputError(str(path), "the file ends after its header line", "give a file with rows of numbers")
    for row, cells in table:
        while len(cells) > len(names) and not cells[-1]:
            cells.pop()
        if len(cells) != len(names):
            raise InputError(
                f"{path}: row {row}",
                f"found {len(cells)} of {len(names)} cells"
                if len(cells) < len(names)
                else f"found {len(cells)} cells where the first line has {len(names)}",
                "give every row as many cells (with decimal commas, separate columns by semicolons)",
            )
    rows = np.array([row for row, _ in table])
    attrs = {"synthetic": True} if any(_SYNTHETIC.match(line.strip()) for line in lines) else {}
    columns = {}
    for k, name in enumerate(names):
        if name:
            cells = [row[k] for _, row in table]
            held = _held(cells)
            read = partial(_numbers, path, name, rows[held], cells[held])
            columns[name] = Column(read, rows=rows[held], attrs=attrs)
    return Table(columns)


def _decode(path: Path) -> str:
    raw = path.read_bytes()
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16")
    if b"\0" in raw:
        raise InputError(str(path), "this is not a text file", "give the suffix of its format")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _separator(line: str) -> str | None:
    """Return what separates the cells of the first line, None for blanks."""
    if len(line.split()) > 1 and all(_is_number(cell) for cell in line.split()):
        return None
    return next((mark for mark in ";\t," if mark in line), None)


def _cells(line: str, separator: str | None) -> list[str]:
    """Split a line; a separator between double quotes belongs to the cell."""
    if separator is not None and '"' in line:
        pieces = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    else:
        pieces = line.split(separator)
    cells = [piece.strip('" \t') for piece in pieces]
    # a name may end in a prime
    return [_QUOTED.sub(r"\1", cell) for cell in cells] if "'" in line else cells


def _held(cells: list[str]) -> slice:
    """Return from where to where a column has cells that are not empty, those inside left to be refused."""
    first = next((k for k, cell in enumerate(cells) if cell), len(cells))
    last = next((k for k in range(len(cells), first, -1) if cells[k - 1]), first)
    return slice(first, last)


def _header(path: Path, cells: list[str]) -> list[str]:
    names = list(cells)
    while names and not names[-1]:
        names.pop()
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(str(path), f"several columns named {sorted(doubled)[0]!r}", "give each its own name")
    return names


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return not cell
    return True


def _numbers(path: Path, name: str, rows: Indices, cells: list[str]) -> Array:
    """Convert one column, reading decimal commas as what they are."""
    commas = [("," in cell) for cell in cells]
    if any(commas):
        points = [row for row, cell in zip(rows, cells, strict=True) if "." in cell]
        if points:
            raise InputError(
                f"{path}: row {points[0]}",
                f"column {name} mixes decimal points with decimal commas",
                "write all numbers alike, without thousands separators",
            )
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        return np.array(cells, dtype=np.str_).astype(float)
    except ValueError:
        for row, cell in zip(rows, cells, strict=True):
            if not cell or not _is_number(cell):
                what = f"{cell!r} is not a number" if cell else "the cell is empty"
                raise InputError(
                    f"{path}: row {row}", f"column {name}: {what}", "correct or remove that row"
                ) from None
        raise
