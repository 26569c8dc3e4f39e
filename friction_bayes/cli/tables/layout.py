"""What the tables have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from friction_bayes.core.text import number

__all__ = ["fitted_part", "two_columns"]


def two_columns(title: str | None = None) -> Table:
    """Return an empty grid of labels and what they stand for."""
    table = Table.grid(padding=(0, 3))
    if title is not None:
        table.title = Text(title, style="bold")
        table.title_justify = "left"
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    return table


def fitted_part(fitted: Mapping[str, Any]) -> str:
    """Say which part of a record was fitted."""
    span = f"{number(fitted['from_s'])} to {number(fitted['to_s'])} s"
    return f"fitted {span}, {fitted['half_cycles']} half cycles"
