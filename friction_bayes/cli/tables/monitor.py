"""Results of monitoring as tables to read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

from friction_bayes.cli.tables.layout import two_columns
from friction_bayes.report.monitor_story import fleet_rows, fleet_title, monitor_rows, monitor_story

__all__ = ["fleet_table", "monitor_table"]

_MOST = 20
"""Machines shown of a fleet; the files hold all."""
_IN_WORDS = ("point", "record", "machine", "remaining life")
"""Headings over words, which are aligned left."""


def monitor_table(result: Mapping[str, Any], read: Sequence[str]) -> Group:
    """Lay out the detection points of a machine and what follows from them.

    Parameters
    ----------
    result : mapping
        As :meth:`MonitorReport.to_dict` gives it, with ``notes``.
    read : sequence of str
        What was understood of the records.
    """
    below = two_columns()
    for text in read:
        below.add_row("read", Text(text))
    for label, text in monitor_story(result):
        below.add_row(label, Text(text, style="bold" if label == "advice" else ""))
    return Group(_filled(Table(box=SIMPLE_HEAD, pad_edge=False), *monitor_rows(result)), below)


def fleet_table(result: Mapping[str, Any]) -> Table:
    """Lay out the most urgent machines of a fleet.

    Parameters
    ----------
    result : mapping
        As in ``monitor.json`` of a fleet.
    """
    headings, rows = fleet_rows(result, _MOST)
    title = f"{fleet_title(result)}; the {len(rows)} most urgent"
    return _filled(Table(title=title, box=SIMPLE_HEAD, title_justify="left"), headings, rows)


def _filled(table: Table, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    for heading in headings:
        if heading.partition("\n")[0] in _IN_WORDS:
            table.add_column(heading, overflow="fold")
        else:
            table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(*row)
    return table
