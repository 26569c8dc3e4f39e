"""How the records of a fleet ended, as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.core.text import words

__all__ = ["counts_table"]


def counts_table(title: str, counts: Mapping[str, Any]) -> Table:
    """Lay out numbers of records.

    Parameters
    ----------
    title : str
        The fleet.
    counts : mapping
        A number under its label, or several under theirs, the largest first here.
    """
    table = two_columns(title)
    for label, number in counts.items():
        if isinstance(number, Mapping):
            largest_first = sorted(number.items(), key=lambda item: -item[1])
            text = ", ".join(f"{words(name)} {count}" for name, count in largest_first)
        else:
            text = str(number)
        if text:
            table.add_row(label, Text(text))
    return table
