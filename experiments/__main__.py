"""``python -m experiments``: run all experiments, or those named, and end in one table beside the paper."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from rich.console import Console

import experiments
from experiments.docs import write_docs
from experiments.paper_comparison import needed_results, write_comparison
from experiments.runner import Experiment, Row, parser_for, run_experiment, settings_digest
from experiments.tables import closing_table


def all_experiments() -> dict[str, Experiment]:
    """Return every experiment of this package by name, those beside the paper's numbers first."""
    found = {}
    for module in iter_modules(experiments.__path__):
        if not module.ispkg and module.name != "__main__":
            experiment = getattr(import_module(f"experiments.{module.name}"), "EXPERIMENT", None)
            if experiment is not None:
                found[experiment.name] = experiment
    return dict(sorted(found.items(), key=lambda item: (item[1].beside != "paper", item[0])))


def _finished(experiment: Experiment, options: argparse.Namespace) -> bool:
    """Whether a result of the same settings and the same sources is there already."""
    target = options.results / f"{experiment.name}.json"
    if not target.exists() or not target.with_suffix(".nc").exists():
        return False
    settings = json.loads(target.read_text(encoding="utf-8"))["settings"]
    return bool(settings == settings_digest(experiment, options))


def _all_there(results: Path) -> bool:
    return all((results / f"{name}.nc").exists() for name in needed_results())


def _record_of(name: str, results: Path) -> dict[str, Any]:
    return json.loads((results / f"{name}.json").read_text(encoding="utf-8"))


def main(argv: Sequence[str] | None = None) -> None:
    """Run what is not there yet and print the one table of all rows beside the paper's numbers."""
    known = all_experiments()
    parser = parser_for("python -m experiments", "Run all experiments; what is finished is kept.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}; all by default")
    parser.add_argument("--docs", type=Path, metavar="FILE", help="bring the tables into this page too")
    options = parser.parse_args(argv)
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"no experiment {unknown[0]!r}: give some of {', '.join(known)}")
    names = options.names or list(known)
    for name in names:
        if _finished(known[name], options):
            print(f"{name}: kept, nothing it depends on has changed", file=sys.stderr)
        else:
            print(f"{name}: {known[name].question}", file=sys.stderr)
            run_experiment(known[name], options)
        # as soon as it can be made: what comes after may need data that are not at hand
        if name in needed_results() and _all_there(options.results):
            print(f"the paper's numbers beside ours: {write_comparison(options.results)}", file=sys.stderr)
    if options.docs is not None:
        write_docs(options.docs, options.results, names)
    console = Console()
    beside_paper = []
    for name in names:
        record = _record_of(name, options.results)
        rows = [Row(**row) for row in record["table"]]
        if record["beside"] == "paper":
            beside_paper += [row for row in rows if row.paper]
        else:
            console.print(f"{name}: {len(rows)} figures in {options.results / f'{name}.md'}")
    if beside_paper:
        console.print(closing_table("all experiments beside the paper", beside_paper, beside="paper"))


if __name__ == "__main__":
    main()
