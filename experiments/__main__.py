"""``python -m experiments``: run all experiments, or those named; end in tables of numbers and of times."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from rich.console import Console
from rich.table import Table

import experiments
from experiments.archive import archived, keep, section_of
from experiments.article import article
from experiments.docs import section, write_docs
from experiments.paper_comparison import compare_with_paper, needed_results, write_comparison
from experiments.paper_page import comparison_page
from experiments.paper_story import write_story
from experiments.runner import Experiment, Row, parser_for, run_experiment, settings_digest
from experiments.sources import ARCHIVE
from experiments.tables import closing_table
from friction_bayes.core.errors import InputError


def all_experiments() -> dict[str, Experiment]:
    """Return every experiment of this package by name, those with numbers of the paper first."""
    found = {}
    for module in iter_modules(experiments.__path__):
        if not module.ispkg and module.name != "__main__":
            experiment = getattr(import_module(f"experiments.{module.name}"), "EXPERIMENT", None)
            if experiment is not None:
                found[experiment.name] = experiment
    return dict(sorted(found.items(), key=lambda item: (item[1].heading != "paper", item[0])))


def _finished(name: str, results: Path, digest: str) -> bool:
    """Whether a result of the same settings and the same sources is there already."""
    target = results / f"{name}.json"
    if not target.exists() or not target.with_suffix(".nc").exists():
        return False
    return bool(json.loads(target.read_text(encoding="utf-8"))["settings"] == digest)


def _record_of(name: str, results: Path) -> dict[str, Any]:
    return json.loads((results / f"{name}.json").read_text(encoding="utf-8"))


def _names(chosen: Sequence[str], known: Mapping[str, Experiment]) -> list[str]:
    """Names of the chosen experiments, a group giving all of its own; all where none is chosen."""
    groups: dict[str, list[str]] = {}
    for name, experiment in known.items():
        groups.setdefault(experiment.group, []).append(name)
    found = [name for each in chosen or known for name in groups.get(each, [each])]
    return list(dict.fromkeys(found))


def _run(
    names: Sequence[str], known: Mapping[str, Experiment], options: argparse.Namespace
) -> dict[str, str]:
    """Run what is not there yet and return what became of each experiment that has a result.

    One that cannot be run, for want of its data, is left out: what was there of it is no result of this code.
    """
    # of the sources as they are loaded now, for all: they may be edited while the first experiments run
    needed = known.keys() & {*names, *needed_results()}
    digests = {name: settings_digest(known[name], options) for name in needed}
    done = {}
    for name in names:
        if _finished(name, options.results, digests[name]):
            print(f"{name}: kept, nothing it depends on has changed", file=sys.stderr)
            done[name] = "kept"
        else:
            print(f"{name}: {known[name].question}", file=sys.stderr)
            try:
                run_experiment(known[name], options, digests[name])
            except InputError as error:
                print(f"{name}: not run. {error}", file=sys.stderr)
                continue
            done[name] = "run"
        # as soon as it can be made, of these sources alone: later experiments may lack their data
        if name in needed_results() and all(
            each in digests and _finished(each, options.results, digests[each]) for each in needed_results()
        ):
            print(f"the paper's numbers and ours: {write_comparison(options.results)}", file=sys.stderr)
    return done


def _time_table(done: Mapping[str, str], results: Path) -> Table:
    """What each experiment took when it was last run, and all that were run now."""
    table = Table(title="time of each experiment", title_justify="left")
    for heading in ("experiment", "wall, s", "processor, s", ""):
        table.add_column(heading, justify="right" if heading.endswith("s") else "left")
    total = [0.0, 0.0]
    for name, how in done.items():
        record = _record_of(name, results)
        seconds = [record["elapsed_s"], record["processor_s"]]
        table.add_row(name, *(f"{each:.0f}" for each in seconds), how)
        if how == "run":
            total = [sum(pair) for pair in zip(total, seconds, strict=True)]
    table.add_row("all that were run", *(f"{each:.0f}" for each in total), "")
    return table


def _write_pages(docs: Path, archive: Path) -> None:
    """Write the pages on the paper, from the archive and from the tables of the documentation."""
    comparison = comparison_page(compare_with_paper(archive))
    (docs / "paper_comparison.md").write_text(comparison, encoding="utf-8")
    write_story(docs)
    (docs / "article.md").write_text(article(archive), encoding="utf-8")


def _show_archived(experiments: Sequence[Experiment], options: argparse.Namespace) -> None:
    """Make the tables of the archive again, on the terminal or in the pages of the documentation."""
    sections = {each.name: section_of(each, options.from_archive) for each in experiments}
    if options.docs is not None:
        write_docs(options.docs, sections)
        if options.docs.is_dir():
            _write_pages(options.docs, options.from_archive)
        return
    for name, text in sections.items():
        print(f"## {name}\n{text}")
    if left := sorted(all_experiments().keys() - archived(options.from_archive)):
        print(f"no results in {options.from_archive}: {', '.join(left)}", file=sys.stderr)


def main(argv: Sequence[str] | None = None) -> None:
    """Run what is not there yet; print the rows with a number of the paper, and the time each took."""
    known = all_experiments()
    parser = parser_for("python -m experiments", "Run all experiments; what is finished is kept.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}, or a group of them; all by default"
    )
    parser.add_argument(
        "--docs", type=Path, metavar="PATH", help="bring the tables into this page, or those of a folder, too"
    )
    parser.add_argument(
        "--archive",
        type=Path,
        nargs="?",
        const=ARCHIVE,
        metavar="DIR",
        help="put the results into this folder too, from which their tables can be made again (%(const)s)",
    )
    parser.add_argument(
        "--from-archive",
        type=Path,
        nargs="?",
        const=ARCHIVE,
        metavar="DIR",
        help="run nothing: print the tables of what is archived, or bring them into --docs (%(const)s)",
    )
    options = parser.parse_args(argv)
    chosen = options.names
    if options.from_archive is not None and not chosen:
        chosen = [name for name in archived(options.from_archive) if name in known]
    names = _names(chosen, known)
    if unknown := [name for name in names if name not in known]:
        groups = dict.fromkeys(experiment.group for experiment in known.values())
        parser.error(
            f"no experiment {unknown[0]!r}: give some of {', '.join(known)}, or of {', '.join(groups)}"
        )
    if options.from_archive is not None:
        _show_archived([known[name] for name in names], options)
        return
    done = _run(names, known, options)
    if options.docs is not None:
        tables = {name: (options.results / f"{name}.md").read_text(encoding="utf-8") for name in done}
        write_docs(
            options.docs,
            {name: section(_record_of(name, options.results), text) for name, text in tables.items()},
        )
    if options.archive is not None:
        for name in done:
            keep(known[name], options.results, options.archive)
    console = Console()
    with_paper = []
    for name in done:
        record = _record_of(name, options.results)
        rows = [Row(**row) for row in record["table"]]
        if record["beside"] == "paper":
            with_paper += [row for row in rows if row.paper]
        else:
            console.print(f"{name}: {len(rows)} figures in {options.results / f'{name}.md'}")
    if with_paper:
        console.print(closing_table("all experiments and the paper", with_paper, heading="paper"))
    console.print(_time_table(done, options.results))
    if left := [name for name in names if name not in done]:
        parser.exit(2, f"not run: {', '.join(left)}\n")


if __name__ == "__main__":
    main()
