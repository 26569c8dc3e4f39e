"""A command in a process of its own: the page stays awake, and what goes wrong there stays there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from friction_bayes.core.progress import PROGRESS
from friction_bayes.report.estimate import friction_sentence
from friction_bayes.report.story import verdict_sentence

__all__ = ["Answer", "Run"]

_DEFECT = "the program ended without an answer (status {status}): {said}"
_PREFIX = "friction-bayes: "


class Run:
    """A command of ``friction-bayes`` that is running, or has run.

    Parameters
    ----------
    arguments : sequence of str
        Those of the command line.
    folder : pathlib.Path
        Where it runs.
    """

    def __init__(self, arguments: Sequence[str], folder: Path) -> None:
        self._began = time.monotonic()
        self._said = ""
        self._stopped = False
        # -P: what lies in the folder of the recording is not imported
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "friction_bayes", *arguments],
            cwd=folder,
            env=os.environ | {PROGRESS: "lines", "PYTHONIOENCODING": "utf-8"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            for line in lines:
                self._said = line.strip() or self._said

    @property
    def going_on(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    @property
    def progress(self) -> str:
        """Seconds since it began, and what it said last."""
        seconds = f"{time.monotonic() - self._began:.0f} s"
        return f"{seconds}, {self._said}" if self._said else seconds

    def stop(self) -> None:
        """End it, if it has not ended."""
        self._stopped |= self.going_on
        self._process.kill()
        self._process.wait()

    def problem(self) -> str:
        """What it complained of; empty where it came to its end. It has ended."""
        self._listener.join()
        status = self._process.wait()
        if self._stopped:
            return "stopped before there was an answer"
        if not status:
            return ""
        said = self._said.removeprefix(_PREFIX)
        return said if status == 2 else _DEFECT.format(status=status, said=said or "nothing was said")


class Answer:
    """What a command has left in its folder.

    Parameters
    ----------
    command : str
        ``estimate`` or ``close-loop``.
    folder : pathlib.Path

    Attributes
    ----------
    page : str
        The report, HTML that loads nothing.
    """

    def __init__(self, command: str, folder: Path) -> None:
        self.page = (folder / "report.html").read_text(encoding="utf-8")
        name = "report.json" if command == "close-loop" else "estimate.json"
        self._result: Mapping[str, Any] = json.loads((folder / name).read_text(encoding="utf-8"))

    @property
    def sentence(self) -> str:
        """The answer in a sentence or two."""
        if "verdict" in self._result:
            return f"{self._result['verdict'].capitalize()}: {verdict_sentence(self._result)}"
        return friction_sentence(self._result)
