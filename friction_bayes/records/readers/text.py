"""Text tables: CSV and its relatives."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES, TIME_UNITS, known_units
from friction_bayes.core.unit_spelling import plain_unit
from friction_bayes.records.readers.clock_times import is_clock_time, seconds_of_clock_times
from friction_bayes.records.readers.headers import read_header
from friction_bayes.records.readers.labview import completed
from friction_bayes.records.readers.table import Column, Table

__all__ = ["TEXT_SUFFIXES", "decode", "read_text", "table_of_lines"]

TEXT_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm")
"""Of files that hold a text table."""

_QUOTED = re.compile(r"^'(.*)'$")
_LOOKED_AT = 60
"""Rows that show how a file is laid out."""
_SAMPLE, _MOST = 4096, 0.9
"""Bytes that show how a file is coded, and the share of every other one that is zero in UTF-16."""
_MOST_SETTINGS = 5
"""Lines of names and values of settings, above a table of fewer columns."""
_UNITS = {*TIME_UNITS, *(unit for quantity in QUANTITIES.values() for unit in known_units(quantity))}
_RULE = re.compile(r"[-=+|:\s,;]*[-=]{3}[-=+|:\s,;]*")
"""A line that sets the header off from the rows under it."""
_IN_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:[.,]\d{3})+")
"""A number whose mark may be that between thousands."""
_SYNTHETIC = re.compile(r"#\s*synthetic\b")


def read_text(path: Path, *, skip_rows: int = 0) -> Table:
    """Read a text table: rows of numbers under one header line, or none (see :func:`table_of_lines`).

    Parameters
    ----------
    path : Path
        The file: UTF-8, UTF-16 or Latin-1, with or without a byte-order mark.
    skip_rows : int
        Lines to pass over at the top, whatever they hold.

    Raises
    ------
    InputError
        If a row has the wrong number of cells, or a cell that is not a number; names the row.
    """
    lines, units = completed(path, decode(path, path.read_bytes()).splitlines())
    columns = table_of_lines(path, lines, skip_rows=skip_rows).columns
    return Table({name: replace(column, unit=units.get(name)) for name, column in columns.items()})


def table_of_lines(path: Path, lines: Sequence[str], *, skip_rows: int = 0) -> Table:
    """Return the table that lines of text are.

    Columns are separated by semicolons, tabs, commas or blanks, whichever the rows of numbers have; names
    above them that are separated otherwise are read if one of them is that of a time. What is above the
    header line, and lines that are blank, begin with ``#`` or are a rule of dashes, is passed over; a comment
    ``# synthetic`` marks the record. A row of units under the header line belongs to it. Empty cells at the
    top or the end of a column are no part of it: runs side by side differ in length.

    Parameters
    ----------
    path : Path
        What messages name.
    lines : sequence of str
    skip_rows : int
        Lines to pass over at the top, whatever they hold.

    Raises
    ------
    InputError
        If a row has the wrong number of cells, or a cell that is not a number; names the row.
    """
    kept = [
        (row, line)
        for row, line in enumerate(lines, start=1)
        if row > skip_rows
        and line.strip()
        and not line.lstrip().startswith("#")
        and not _RULE.fullmatch(line.strip())
    ]
    if not kept:
        raise InputError(
            str(path), "the file holds no data", "give a file with a header line and rows of numbers"
        )
    try:
        names, table = _layout(path, kept)
    except csv.Error as error:
        raise InputError(
            str(path), f"this is no table ({error})", "give a file with rows of numbers"
        ) from None
    _check_rows(path, names, table)
    if names == _by_number(len(names)):
        names = _commented_names(lines[: table[0][0] - 1], len(names)) or names
    rows = np.array([row for row, _ in table])
    attrs = {"synthetic": True} if any(_SYNTHETIC.match(line.strip()) for line in lines) else {}
    columns, decimal = {}, _decimal_mark([cells for _, cells in table])
    for k, name in enumerate(names):
        if name:
            cells = [row[k] for _, row in table]
            held = _held(cells)
            since = next((cell for cell in cells[held][:1] if is_clock_time(cell)), None)
            to_numbers = partial(_numbers, decimal) if since is None else _clock_times
            read = partial(to_numbers, path, name, rows[held], cells[held])
            columns[name] = Column(read, since=since, rows=rows[held], attrs=attrs)
    return Table(columns)


def _check_rows(path: Path, names: list[str], table: list[tuple[int, list[str]]]) -> None:
    """Refuse rows of another width than the header's, and its coming again; drop empty cells at the end."""
    again = [row for row, cells in table if cells[0] == names[0] and cells[: len(names)] == names]
    if again and names != _by_number(len(names)):
        # an archive and a workbook have no --skip-rows
        plain = path.suffix.lower() in TEXT_SUFFIXES and path.is_file()
        last = f", or read the last one by --skip-rows {again[-1] - 1}" if plain else ""
        raise InputError(
            f"{path}: row {again[0]}",
            f"the header line comes again, as of {len(again) + 1} recordings one behind the other",
            f"split the file there and give each by itself{last}",
        )
    for row, cells in table:
        while len(cells) > len(names) and not cells[-1]:
            cells.pop()
        if len(cells) == len(names):
            continue
        if len(cells) < len(names) and row == table[-1][0]:
            raise InputError(
                f"{path}: row {row}",
                f"found {len(cells)} of {len(names)} cells in the last row, cut off or no part of the table",
                "remove that row",
            )
        raise InputError(
            f"{path}: row {row}",
            f"found {len(cells)} of {len(names)} cells"
            if len(cells) < len(names)
            else f"found {len(cells)} cells where the first line has {len(names)}",
            "give every row as many cells (with decimal commas, separate columns by semicolons)",
        )


def _by_number(count: int) -> list[str]:
    """Names of columns that have none."""
    return [str(k) for k in range(count)]


def _commented_names(above: Sequence[str], count: int) -> list[str] | None:
    """So many names on a comment right above the numbers, as NumPy writes them; otherwise None."""
    line = next((line.strip() for line in reversed(above) if line.strip()), "")
    return _names_of(line.lstrip("# "), count) if line.startswith("#") else None


def _names_of(line: str, count: int) -> list[str] | None:
    """So many names on a line, however they are separated; None where there are not so many."""
    splits = (_cells(line, separator) for separator in ("\t", ";", ",", None))
    fit = (cells for cells in splits if len(cells) == count and not any(map(_is_number, cells)))
    return next(fit, None)


def _names_split_otherwise(line: str, count: int) -> list[str] | None:
    """So many names on a line whose separator is not that of the numbers; one is a time, or it is a title."""
    names = _names_of(line, count)
    return names if names and any(read_header(name).is_time for name in names) else None


def _layout(path: Path, kept: list[tuple[int, str]]) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Separate the header from the lines above it; return names and rows with their numbers in the file."""
    # what most rows look like, from some strewn over all but the top of the file
    some = [line for _, line in kept[len(kept) // 4 :: max(len(kept) // _LOOKED_AT, 1)]]
    separator = Counter(map(_separator, some)).most_common(1)[0][0]
    lines = [(row, _cells(line, separator)) for row, line in kept]
    lines = [(row, cells) for row, cells in lines if any(cells)]
    typical = [_cells(line, separator) for line in some]
    width = Counter(_width(cells) for cells in typical).most_common(1)[0][0]
    numeric = [
        k
        for k in range(width)
        if any(_width(row) == width and row[k] and _is_number(row[k]) for row in typical)
    ]

    def numbers(cells: list[str]) -> list[bool]:
        return [bool(cells[k]) and _is_number(cells[k]) for k in numeric if k < len(cells)]

    data = next(
        (
            i
            for i, (_, cells) in enumerate(lines)
            if width in (len(cells), _width(cells))
            and any(numbers(cells))
            and all(_is_number(cells[k]) for k in numeric if k < len(cells))
        ),
        None,
    )
    if data is None:
        ends = len(lines) == 1 or not numeric
        what = "the file ends after its header line" if ends else "no row of numbers was found"
        raise InputError(str(path), what, "give a file with rows of numbers")
    header = next(
        (
            i
            for i in range(data - 1, -1, -1)
            if _width(lines[i][1]) >= width and not any(numbers(lines[i][1]))
        ),
        None,
    )
    if header is not None and _are_settings([cells for _, cells in lines[header : data + 1]]):
        header = None
    if header is None and data and (names := _names_split_otherwise(dict(kept)[lines[data - 1][0]], width)):
        return _header(path, names), lines[data:]
    if header is None:
        if data and _width(lines[data - 1][1]) > 1 and not any(numbers(lines[data - 1][1])):
            raise InputError(
                f"{path}: row {lines[data][0]}",
                f"found {width} cells where the first line has {_width(lines[data - 1][1])}",
                "give every row as many cells (with decimal commas, separate columns by semicolons)",
            )
        table = lines[data:]
        return _by_number(max(_width(cells) for _, cells in table)), table
    table = lines[header + 1 :]
    names = lines[header][1]
    if separator is None and len(names) > width:
        names = _names_with_blanks(dict(kept)[lines[header][0]], width) or names
    if header and _width(lines[header - 1][1]) >= width and _are_units(names):
        above = lines[header - 1][1]
        names = [
            f"{name} ({unit.strip('()[]')})" if unit else name
            for name, unit in zip(above, names, strict=False)
        ]
    # a name without a cell under it, as LabVIEW's Comment
    return _header(path, names[: max(len(cells) for _, cells in table)]), table


def _names_with_blanks(line: str, count: int) -> list[str] | None:
    """So many names among blanks, each with blanks or a unit in brackets; None where they are not so many."""
    splits = (re.split(pattern, line.strip()) for pattern in (r"\s{2,}|\t", r"\s+(?![(\[])"))
    return next((cells for cells in splits if len(cells) == count), None)


def _are_settings(lines: list[list[str]]) -> bool:
    """Whether lines from a header to the first row of numbers are names and values of settings, and that row.

    There are a few of them, and all have more cells than that row.
    """
    *above, row = lines
    return 1 < len(above) <= _MOST_SETTINGS and all(len(cells) > len(row) for cells in above)


def _width(cells: list[str]) -> int:
    """Return the number of cells up to the last that is not empty."""
    return next((k for k in range(len(cells), 0, -1) if cells[k - 1]), 0)


def _are_units(cells: list[str]) -> bool:
    """Whether a line holds units and nothing else."""
    held = [cell for cell in cells if cell]
    known = [plain_unit(cell) in _UNITS for cell in held]
    return any(known) and all(k or cell[0] in "([" for k, cell in zip(known, held, strict=True))


def decode(path: Path, raw: bytes) -> str:
    """Return the text of a file: UTF-8, UTF-16 or Latin-1.

    Raises
    ------
    InputError
        If it is no text.
    """
    utf16 = "utf-16" if raw.startswith((b"\xff\xfe", b"\xfe\xff")) else _utf16_without_mark(raw)
    if utf16 is not None:
        try:
            return raw.decode(utf16)
        except UnicodeDecodeError as error:
            raise InputError(
                str(path), "begins as UTF-16 text and does not go on as such", "save it anew as text"
            ) from error
    if b"\0" in raw:
        raise InputError(str(path), "this is not a text file", "give the suffix of its format")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _utf16_without_mark(raw: bytes) -> str | None:
    """Name the order of bytes, every other of which is zero in text of Western letters; None where not."""
    start = np.frombuffer(raw[: 2 * (min(len(raw), _SAMPLE) // 2)], np.uint8).reshape(-1, 2)
    if not start.size:
        return None
    for order, (letters, others) in (("utf-16-le", (0, 1)), ("utf-16-be", (1, 0))):
        # no letter comes before the tab
        if np.mean(start[:, others] == 0) > _MOST and start[:, letters].min() >= ord("\t"):
            return order
    return None


def _separator(line: str) -> str | None:
    """Return what separates the cells of a line, None for blanks."""
    line = line.strip()
    mark = next((mark for mark in ";\t" if mark in line), None)
    if mark is not None or "," not in line:
        return mark
    words = line.split()
    # the commas are decimal ones
    return None if len(words) > 1 and all(map(_is_number, words)) else ","


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
    doubled = {name for name in names if name and names.count(name) > 1}
    if doubled:
        raise InputError(str(path), f"several columns named {sorted(doubled)[0]!r}", "give each its own name")
    return names


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return not cell
    return True


def _clock_times(path: Path, name: str, rows: Indices, cells: list[str]) -> Array:
    """Convert a column of times of the day."""
    seconds = seconds_of_clock_times(cells)
    if seconds is not None:
        return seconds
    row, cell = next(
        ((row, cell) for row, cell in zip(rows, cells, strict=True) if not is_clock_time(cell)),
        (rows[0], cells[0]),
    )
    raise InputError(
        f"{path}: row {row}",
        f"column {name}: {cell!r} is not a time of the day like {cells[0]}",
        "correct or remove that row, or give --sampling-rate",
    )


def _decimal_mark(table: list[list[str]]) -> str:
    """Which of comma and point numbers have for decimals alone; empty where both or neither do."""
    marks = [
        mark
        for mark in ",."
        if any(
            mark in cell and not _IN_THOUSANDS.fullmatch(cell) and _is_number(cell)
            for cells in table
            for cell in cells
        )
    ]
    return marks[0] if len(marks) == 1 else ""


def _numbers(decimal: str, path: Path, name: str, rows: Indices, cells: list[str]) -> Array:
    """Convert one column, reading decimal commas as what they are."""
    other = {",": ".", ".": ","}.get(decimal)
    grouped = [k for k, cell in enumerate(cells) if other and other in cell and _is_number(cell)]
    if grouped:
        raise InputError(
            f"{path}: row {rows[grouped[0]]}",
            f"column {name}: {cells[grouped[0]]} is in thousands, or decimal where other numbers have "
            f"{decimal!r} for that",
            "write all numbers alike, without thousands separators",
        )
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
        wrong = [k for k, cell in enumerate(cells) if not cell or not _is_number(cell)]
        if not wrong:
            raise
        row, cell = rows[wrong[0]], cells[wrong[0]]
        what = f"{cell!r} is not a number" if cell else "the cell is empty"
        remedy = "correct or remove that row"
        if len(wrong) > 1:
            what += f", one of {len(wrong)} without a number"
            remedy = "correct or remove those rows, the times need not be even"
        if ":" in cell:
            remedy = "write times like 12:03:04.250 or 2024-03-01T12:03:04.250, or give --sampling-rate"
        raise InputError(f"{path}: row {row}", f"column {name}: {what}", remedy) from None
