"""What a command says: results on standard output, progress and notes on standard error of a terminal."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)

from friction_bayes.errors import NotConvergedWarning, RecordWarning

__all__ = ["collected_warnings", "note", "output_console", "progress_bar"]

# A pipe or a file has no width; tables are then laid out for this one.
_PAPER_WIDTH = 120


def output_console() -> Console:
    """Return the console of standard output, wide enough for every table when that is no terminal."""
    # File names may hold brackets, which are no markup.
    width = None if sys.stdout.isatty() else _PAPER_WIDTH
    return Console(width=width, highlight=False, markup=False)


def note(text: str) -> None:
    """Say something on standard error, if that is a terminal."""
    if sys.stderr.isatty():
        Console(stderr=True, highlight=False, markup=False).print(text, style="dim")


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Yield a progress bar on standard error, invisible where that is no terminal."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not sys.stderr.isatty()) as bar:
        yield bar


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Yield a list that receives this package's warnings; those of others go on as they came."""
    messages: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        for category in (RecordWarning, NotConvergedWarning):
            warnings.simplefilter("always", category)
        yield messages
    for entry in caught:
        if issubclass(entry.category, RecordWarning | NotConvergedWarning):
            messages.append(str(entry.message))
        else:
            warnings.warn_explicit(entry.message, entry.category, entry.filename, entry.lineno)
