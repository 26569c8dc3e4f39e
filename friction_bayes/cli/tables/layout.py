"""What the tables have in common."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

__all__ = ["two_columns"]


def two_columns(title: str | None = None) -> Table:
    """Return an empty grid of labels and texts."""
    table = Table.grid(padding=(0, 3))
    if title is not None:
        table.title = Text(title, style="bold")
        table.title_justify = "left"
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    return table
