"""Tables that an experiment ends in: on the terminal, and in Markdown for the documentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.table import Table

__all__ = ["Row", "closing_table", "page"]


@dataclass(frozen=True)
class Row:
    """One line of the table that an experiment ends in, beside the paper's number where it has one."""

    what: str
    ours: str
    paper: str = ""
    remark: str = ""
    sampler: str = ""


def _columns(rows: Sequence[Row], beside: str) -> dict[str, list[str]]:
    """Text of each column; the sampler's is left out where there is none."""
    columns = {
        "what": [row.what for row in rows],
        "ours": [row.ours for row in rows],
        beside: [row.paper for row in rows],
        "remark": [row.remark for row in rows],
    }
    sampler = [row.sampler for row in rows]
    return columns | ({"emcee": sampler} if any(sampler) else {})


def closing_table(title: str, rows: Sequence[Row], *, beside: str) -> Table:
    """Return the rows as a table for the terminal.

    Parameters
    ----------
    title : str
    rows : sequence of Row
    beside : str
        Heading of the column that ours stands beside.
    """
    table = Table(title=title, title_justify="left")
    columns = _columns(rows, beside)
    for heading in columns:
        table.add_column(heading, overflow="fold")
    for line in zip(*columns.values(), strict=True):
        table.add_row(*line)
    return table


def _markdown(columns: Mapping[str, Sequence[str]]) -> str:
    lines = [list(columns), ["---"] * len(columns), *zip(*columns.values(), strict=True)]
    return "\n".join("| " + " | ".join(text.replace("|", "\\|") for text in line) + " |" for line in lines)


def page(rows: Sequence[Row], details: Sequence[Mapping[str, str]], *, beside: str) -> str:
    """Return the closing table and, below it, the details as Markdown.

    Parameters
    ----------
    rows : sequence of Row
    details : sequence of mappings
        Text by column heading, the same columns in every line; none for no second table.
    beside : str
        Heading of the column that ours stands beside.
    """
    tables = [_markdown(_columns(rows, beside))]
    if details:
        tables.append(_markdown({heading: [line[heading] for line in details] for heading in details[0]}))
    return "\n\n".join(tables) + "\n"
