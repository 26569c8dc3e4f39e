"""What every comparison needs: who is installed, and processor times, cold and warm.

Cold is the first result of a fresh process with empty caches, imports and compilation included. A peer's
clock starts when its data are ready, which this package makes for it; ours starts with the process. Of two
contestants the ratio of times is the median of those of runs in turn, so that it means the same on a busy
machine. Times are processor times of all threads.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from statistics import median
from time import process_time
from typing import Any

__all__ = ["bold", "cold", "first_run", "missing", "over", "table", "timed", "versions"]


def missing(packages: Iterable[str]) -> list[str]:
    """Which of some packages are not installed."""
    absent = []
    for name in packages:
        try:
            version(name)
        except PackageNotFoundError:
            absent.append(name)
    return absent


def versions(packages: Iterable[str]) -> str:
    """Packages with their versions, in words."""
    return ", ".join(f"{name} {version(name)}" for name in packages)


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of a work, and what it gave."""
    started = process_time()
    found = work()
    return process_time() - started, found


def first_run(module: Any, contestant: str) -> tuple[float, Any]:
    """Processor time of a contestant's first run in this process, and what it gave in one number.

    Parameters
    ----------
    module : module
        A section with ``OURS``, ``prepared(contestant)``, which makes its data and returns its run, and
        ``summary`` of what the run gives.
    contestant : str
        Its name.
    """
    run = module.prepared(contestant)
    # processes that compile count
    started = 0.0 if contestant == module.OURS else sum(os.times()[:4])
    found = run()
    return sum(os.times()[:4]) - started, module.summary(found)


def cold(section: str, contestant: str) -> tuple[float, Any]:
    """What :func:`first_run` gives in a fresh process with empty caches."""
    with tempfile.TemporaryDirectory() as empty:
        environment = {**os.environ, "NUMBA_CACHE_DIR": empty, "PYTENSOR_FLAGS": f"base_compiledir={empty}"}
        ran = subprocess.run(
            [sys.executable, "-W", "ignore", "-m", "benchmarks.peers", section, "--first", contestant],
            env=environment, check=True, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
    spent, found = json.loads(ran.stdout.splitlines()[-1])
    return spent, found


def over(times: Sequence[float], ours: Sequence[float]) -> float:
    """Median of the ratios of paired times."""
    return median(a / b for a, b in zip(times, ours, strict=True))


def bold(text: str, better: bool) -> str:
    """In bold what does better than this package."""
    return f"**{text}**" if better else text


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = [headings, ["---"] * len(headings), *rows]
    return [f"| {' | '.join(line)} |" for line in lines]
