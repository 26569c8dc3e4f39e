"""What a command says: results on standard output, progress and notes on standard error of a terminal."""

from __future__ import annotations

import io
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, cast

from friction_bayes.core.errors import NotConvergedWarning, RecordWarning
from friction_bayes.core.progress import LinesOfProgress, lines_wanted, write_line

# rich is loaded by what prints, so that help and refused options need not wait for it
if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

__all__ = ["collected_warnings", "compilation_noted", "note", "output_console", "progress_bar"]

# A pipe or a file has no width; tables are then laid out for this one.
_PAPER_WIDTH = 120
_COMPILING = "compiling the numerical kernels, once on this machine: up to 40 s, longer where it is busy"


class _Paper(io.TextIOBase):
    """Standard output that is not a terminal, without the blanks that pad the cells of a table."""

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return sys.stdout.encoding

    def write(self, text: str) -> int:
        sys.stdout.write(re.sub(r" +$", "", text, flags=re.MULTILINE))
        return len(text)

    def flush(self) -> None:
        sys.stdout.flush()


def output_console() -> Console:
    """Return the console of standard output, wide enough for every table when that is not a terminal."""
    from rich.console import Console

    if isinstance(sys.stdout, io.TextIOWrapper):
        # a locale that cannot write the sign of plus or minus must not cost the result
        sys.stdout.reconfigure(errors="replace")
    # File names may hold brackets, which are no markup.
    if sys.stdout.isatty():
        return Console(highlight=False, markup=False)
    return Console(file=cast(IO[str], _Paper()), width=_PAPER_WIDTH, highlight=False, markup=False)


def note(text: str) -> None:
    """Say something on standard error, if that is a terminal or somebody reads its lines."""
    if lines_wanted():
        write_line(text)
    elif sys.stderr.isatty():
        from rich.console import Console

        Console(stderr=True, highlight=False, markup=False).print(text, style="dim")


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Yield a progress bar on standard error, invisible where that is not a terminal."""
    if lines_wanted():
        yield cast("Progress", LinesOfProgress())
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
    )

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
        if isinstance(entry.message, RecordWarning):
            messages.append(entry.message.for_command_line)
        elif isinstance(entry.message, NotConvergedWarning):
            messages.append(str(entry.message))
        else:
            warnings.warn_explicit(entry.message, entry.category, entry.filename, entry.lineno)


@contextmanager
def compilation_noted() -> Iterator[None]:
    """Note within this context that kernels are compiled, if they are, which takes long and happens once."""
    # numba takes a second to load, which bad input need not wait for
    from friction_bayes.mechanics.compilation import compilation_announced

    with compilation_announced(lambda: note(_COMPILING)):
        yield
