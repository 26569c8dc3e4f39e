"""Tables that an experiment ends in: on the terminal, and in Markdown for the documentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.table import Table

__all__ = ["Row", "closing_table", "markdown", "page"]


@dataclass(frozen=True)
class Row:
    """One line of the table that an experiment ends in, with the paper's number where there is one."""

    what: str
    ours: str
    paper: str = ""
    remark: str = ""
    sampler: str = ""


def _lines(rows: Sequence[Row], heading: str) -> list[dict[str, str]]:
    """Text of each row by column heading; the sampler's column is left out where all is empty."""
    sampled = any(row.sampler for row in rows)
    return [
        {"what": row.what, "ours": row.ours, heading: row.paper, "remark": row.remark}
        | ({"emcee": row.sampler} if sampled else {})
        for row in rows
    ]


def closing_table(title: str, rows: Sequence[Row], *, heading: str) -> Table:
    """Return the rows as a table for the terminal.

    Parameters
    ----------
    title : str
    rows : sequence of Row
    heading : str
        Of the column that ours is compared with.
    """
    table = Table(title=title, title_justify="left")
    lines = _lines(rows, heading)
    for name in lines[0]:
        table.add_column(name, overflow="fold")
    for line in lines:
        table.add_row(*line.values())
    return table


def markdown(lines: Sequence[Mapping[str, str]]) -> str:
    """Return a table in Markdown.

    Parameters
    ----------
    lines : sequence of mappings
        Text by column heading, the same columns in every line; at least one line.
    """
    cells = [list(lines[0]), ["---"] * len(lines[0]), *(list(line.values()) for line in lines)]
    rows = ("| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in cells)
    return "\n".join(rows) + "\n"


def page(rows: Sequence[Row], details: Sequence[Mapping[str, str]], *, heading: str) -> str:
    """Return the closing table and, below it, the details as Markdown.

    Parameters
    ----------
    rows : sequence of Row
    details : sequence of mappings
        Text by column heading, the same columns in every line; none for no second table.
    heading : str
        Of the column that ours is compared with.
    """
    tables = [markdown(_lines(rows, heading))]
    if details:
        tables.append(markdown(details))
    return "\n".join(tables)
