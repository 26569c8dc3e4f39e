"""Compare this package with others: ``python -m benchmarks.peers [SECTION ...] [--page PAGE]``.

Prints a table a section; ``--page`` puts each between the markers of a Markdown page. The extra ``peers``
brings the other packages, which nothing else of this one uses.
"""

from __future__ import annotations

import argparse
import json
from importlib import import_module
from pathlib import Path

from benchmarks.peers.measuring import first_run, missing, versions

SECTIONS = (
    "friction_samples",
    "conjugate_updates",
    "whole_signal",
    "plain_decay",
    "missing_term",
    "linear_filter",
)
"""Modules with ``PACKAGES``, ``compare()`` and, where cold times are taken, what
:func:`benchmarks.peers.measuring.first_run` needs."""


def section(name: str) -> list[str]:
    """How a section was made, and its table.

    Raises
    ------
    SystemExit
        If packages are not installed, with their names.
    """
    module = import_module(f"benchmarks.peers.{name}")
    absent = missing(module.PACKAGES)
    if absent:
        raise SystemExit(f"{name}: {', '.join(absent)} not installed; pip install 'friction-bayes[peers]'")
    return [f"`python -m benchmarks.peers {name}`; {versions(module.PACKAGES)}.", "", *module.compare()]


def main(arguments: list[str] | None = None) -> None:
    """Measure, and print or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"{', '.join(SECTIONS)}")
    parser.add_argument("--first", metavar="NAME", help="print what its first run gives, for cold times")
    parser.add_argument("--page", type=Path, help="Markdown page to put the tables into")
    options = parser.parse_args(arguments)
    unknown = set(options.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    if options.first is not None:
        (name,) = options.sections
        print(json.dumps(first_run(import_module(f"benchmarks.peers.{name}"), options.first)))
        return
    for name in options.sections or SECTIONS:
        lines = section(name)
        print("\n".join(lines), end="\n\n", flush=True)
        if options.page is not None:
            # experiments behind it would count in cold times
            from benchmarks.accuracy import written_between

            written_between(options.page, f"peers {name}", lines)


if __name__ == "__main__":
    main()
