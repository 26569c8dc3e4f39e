"""Spreadsheets: the first sheet that holds rows of numbers, read as the lines of a text table."""

from __future__ import annotations

from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.archive import check_unpacked_size, is_zip
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Table
from friction_bayes.records.readers.text import table_of_lines

__all__ = ["read_excel"]

_LEAST_ROWS = 8
"""Rows of numbers from which on a sheet is a record and no table of settings."""


def read_excel(path: Path) -> Table:
    """Read a sheet of an Excel or OpenDocument file, by the rules of text tables.

    Parameters
    ----------
    path : Path
        The file, ``.xlsx``, ``.xls`` or ``.ods``. Formulas count by the value that was saved with them.

    Raises
    ------
    InputError
        If it is no such file, unpacks to too much, or none of its sheets holds a record.
    """
    if is_zip(path):
        check_unpacked_size(path)
    calamine = optional_package("python_calamine", path)
    try:
        book = calamine.CalamineWorkbook.from_path(str(path))
        sheets = {name: book.get_sheet_by_name(name).to_python() for name in book.sheet_names}
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a spreadsheet file ({error})", "save it anew, or as CSV"
        ) from None
    for rows in sheets.values():
        if sum(_has_numbers(row) for row in rows) >= _LEAST_ROWS:
            return table_of_lines(path, ["\t".join(map(_text, row)) for row in rows])
    raise InputError(
        str(path),
        f"none of its sheets ({', '.join(sheets)}) has {_LEAST_ROWS} rows of numbers",
        "give a file with a header row and rows of numbers below it",
    )


def _has_numbers(row: list[Any]) -> bool:
    return any(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in row)


def _text(cell: Any) -> str:
    """A cell as text files have it."""
    if isinstance(cell, datetime | time):
        return cell.isoformat(timespec="microseconds")
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, date):
        return f"{cell.isoformat()}T00:00:00"
    if isinstance(cell, float):
        return repr(cell)
    return " ".join(str(cell).split())
