"""Text tables: CSV and its relatives."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_text"]

_SYNTHETIC = re.compile(r"#\s*synthetic\b")


def read_text(path: Path, *, skip_lines: int = 0) -> Table:
    """Read a text table of one header line, or none, and rows of numbers.

    Columns are separated by semicolons, tabs, commas or blanks (the first of these that the first line has).
    Lines that are blank or begin with ``#`` are passed over; a comment ``# synthetic`` marks the record.

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
        (row, line.strip())
        for row, line in enumerate(lines, start=1)
        if row > skip_lines and line.strip() and not line.lstrip().startswith("#")
    ]
    if not kept:
        raise InputError(
            str(path), "the file holds no data", "give a file with a header line and rows of numbers"
        )
    separator = _separator(kept[0][1])
    table = [(row, [cell.strip("\"' ") for cell in line.split(separator)]) for row, line in kept]
    if all(_is_number(cell) for cell in table[0][1]):
        names = [str(k) for k in range(len(table[0][1]))]
    else:
        names = _header(path, table.pop(0)[1])
    if not table:
        raise InputError(str(path), "the file ends after its header line", "give a file with rows of numbers")
    for row, cells in table:
        if len(cells) == len(names) + 1 and not cells[-1]:
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
    columns = {
        name: Column(partial(_numbers, path, name, rows, [cells[k] for _, cells in table]), attrs=attrs)
        for k, name in enumerate(names)
        if name
    }
    return Table(columns, rows=rows)


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


def _header(path: Path, cells: list[str]) -> list[str]:
    names = cells[:-1] if not cells[-1] else cells
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
