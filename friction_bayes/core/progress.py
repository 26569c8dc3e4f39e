"""Progress of a command in plain lines, for the program that has started it and reads them."""

from __future__ import annotations

import os
import sys
from typing import Any

__all__ = ["PROGRESS", "LinesOfProgress", "lines_wanted", "write_line"]

PROGRESS = "FRICTION_BAYES_PROGRESS"
"""Set to ``lines`` in the environment of a command, its notes and progress are lines on standard error."""


def lines_wanted() -> bool:
    """Whether the program that has started this one reads lines of progress."""
    return os.environ.get(PROGRESS) == "lines"


def write_line(text: str) -> None:
    """Write a line at once."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


class LinesOfProgress:
    """As much of rich's progress bar as commands use."""

    def __init__(self) -> None:
        self._now: dict[str, Any] = {"description": "", "completed": 0, "total": None}

    def add_task(self, description: str, total: float | None = None) -> int:
        """Begin."""
        self._now |= {"description": description, "total": total}
        return 0

    def update(self, task: int, **now: Any) -> None:
        """Write where it is: ``description``, ``completed`` and ``total``, as far as they are new."""
        self._now |= now
        due = "" if self._now["total"] is None else f" of {self._now['total']:.0f}"
        write_line(f"step {self._now['completed']:.0f}{due}: {self._now['description']}")

    def advance(self, task: int) -> None:
        """Write that one more step is done."""
        self.update(task, completed=self._now["completed"] + 1)
