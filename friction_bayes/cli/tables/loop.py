"""What closing the loop found, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.report.story import loop_story

__all__ = ["loop_digest", "loop_table"]

_DIGEST = ("verdict", "friction before", "friction after", "effects", "reference", "next experiment")


def loop_table(title: str, result: Mapping[str, Any], read: Sequence[str]) -> Table:
    """Lay out what closing the loop found.

    Parameters
    ----------
    title : str
        The records.
    result : mapping
        Fields of ``report.json`` and ``notes``.
    read : sequence of str
        What was understood of each record.
    """
    table = two_columns(title)
    for text in read:
        table.add_row("read", Text(text))
    for label, text in loop_story(result, len(read)):
        bold = label in {"verdict", "friction after"}
        table.add_row(label, Text(text, style="bold" if bold else ""))
    for text in result["notes"]:
        table.add_row("note", Text(text))
    return table


def loop_digest(title: str, result: Mapping[str, Any], records: int) -> Table:
    """Lay out the few lines of what closing the loop found that a reader in a hurry needs.

    Parameters
    ----------
    title : str
        What the records are.
    result : mapping
        Fields of ``report.json``.
    records : int
        How many they are.
    """
    table = two_columns(title)
    for label, text in loop_story(result, records):
        if label in _DIGEST:
            table.add_row(label, Text(text))
    return table
