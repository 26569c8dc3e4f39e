"""Where one estimate, one loop and the start of the program take their time, by part of the package.

``python -m benchmarks.profiles [--page PAGE]`` prints tables; ``--page`` puts them between the markers of a
Markdown page. Times are processor times of one thread, kernels compiled before unless it says cold.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import friction_bayes
from benchmarks.accuracy import written_between
from benchmarks.loops import loops_table, plain_record
from friction_bayes import close_loop, estimate, simulate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM, paper_example
from friction_bayes.records.writers import write_record

PACKAGE = Path(friction_bayes.__file__).parent
LISTED = 5
STARTS = {
    "`friction-bayes --help`": ["-m", "friction_bayes", "--help"],
    "`import friction_bayes`": ["-c", "import friction_bayes"],
    "`friction_bayes.estimate` found": ["-c", "import friction_bayes as fb; fb.estimate"],
}
IMPORTS = ["-c", "import numpy, scipy, numba, xarray, matplotlib"]
"""What the packages below take alone."""
COMMAND_SAMPLES, PAIRS = 4_000, 5


def part_of(file: str) -> str:
    """Folder of this package, or the package from outside, that a function belongs to."""
    path = Path(file)
    if path.is_relative_to(PACKAGE):
        return path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    for outside in ("numpy", "scipy", "xarray", "numba"):
        if outside in path.parts:
            return outside
    return "Python"


def profiled(work: Callable[[], Any]) -> tuple[float, str]:
    """Processor time of a work, and the share of its parts in words."""
    work()
    started = process_time()
    work()
    elapsed = process_time() - started
    profile = cProfile.Profile(process_time)
    profile.runcall(work)
    shares: Counter[str] = Counter()
    for (file, _, _), (_, _, own, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        shares[part_of(file)] += own
    total = sum(shares.values())
    parts = [f"{part} {100.0 * own / total:.0f} %" for part, own in shares.most_common(LISTED)]
    return elapsed, ", ".join(parts)


def started(arguments: list[str], **environment: str) -> float:
    """Processor time of a new Python that does so little."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    run = [sys.executable, *arguments]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL, env={**os.environ, **environment})
    return used() - before


def warm(arguments: list[str]) -> float:
    """Processor time of the second start."""
    started(arguments)
    return started(arguments)


def commands_table() -> list[str]:
    """Commands on a file, with no kernel compiled before and, over importing what they need, with all."""
    record, system, _ = plain_record(COMMAND_SAMPLES)
    lines = ["| command | s |", "|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "record.csv"
        write_record(record, file)
        given = [str(file), "--mass", f"{system.moving:g}", "--stiffness", f"{system.stiffness:g}"]
        commands = {
            "estimate": ["-m", "friction_bayes", "estimate", *given],
            "close-loop": [
                "-m",
                "friction_bayes",
                "close-loop",
                *given,
                "--out",
                f"{folder}/loop",
                "--force",
            ],
        }
        for name, command in commands.items():
            cold = started(command, NUMBA_CACHE_DIR=f"{folder}/{name}")
            lines.append(f"| `friction-bayes {name}`, cold | {cold:.1f} |")
        for name, command in commands.items():
            warm(command)
            pairs = [(started(command), started(IMPORTS)) for _ in range(PAIRS)]
            spent, ratio = (median(each) for each in zip(*((a, a / b) for a, b in pairs), strict=True))
            lines.append(f"| `friction-bayes {name}`, warm: {ratio:.1f} times `{IMPORTS[1]}` | {spent:.1f} |")
    return lines


def main() -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.profiles", description=__doc__)
    parser.add_argument("--page", type=Path, help="Markdown page to put the table into")
    options = parser.parse_args()
    record = paper_example(seed=1)
    short = simulate(
        PAPER_SYSTEM,
        friction=PAPER_FRICTION,
        initial_displacement=PAPER_RELEASE,
        duration=20.0,
        sampling_rate=150.0,
        noise_sd=2e-4,
        seed=1,
    )
    works = {
        "`estimate`, 33,000 samples": lambda: estimate(record, PAPER_SYSTEM),
        "`estimate`, `random_force=none`": lambda: estimate(record, PAPER_SYSTEM, random_force="none"),
        "`close_loop`, 3,000 samples": lambda: close_loop([short], PAPER_SYSTEM, seed=1),
    }
    lines = ["`python -m benchmarks.profiles`", "", "| path | s | its parts |", "|---|---|---|"]
    for name, work in works.items():
        elapsed, parts = profiled(work)
        lines.append(f"| {name} | {elapsed:.2f} | {parts} |")
    lines += [f"| {name} | {warm(arguments):.2f} | |" for name, arguments in STARTS.items()]
    lines += ["", *loops_table(), "", *commands_table()]
    print("\n".join(lines))
    if options.page is not None:
        written_between(options.page, "profiles", lines)


if __name__ == "__main__":
    main()
