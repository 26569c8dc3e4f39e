"""``friction-bayes datasets``: the measured data sets that have a name."""

from __future__ import annotations

import argparse
from typing import Any

from friction_bayes.cli.console import output_console

__all__ = ["add_parser"]

_EPILOG = """examples:
  friction-bayes datasets list
  friction-bayes datasets get string-pendulum
  friction-bayes estimate dataset:string-pendulum
"""


def add_parser(commands: Any) -> None:
    """Add ``datasets list`` and ``datasets get NAME``."""
    parser = commands.add_parser(
        "datasets",
        help="list measured data sets, or fetch one",
        description="Measured decays by name; every command takes dataset:NAME[/PART] for a record.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="names, what was measured, licence", allow_abbrev=False)
    listing.set_defaults(handler=run_list)
    getting = actions.add_parser("get", help="download a set and check its digests", allow_abbrev=False)
    getting.add_argument("name", metavar="NAME", help="as in the list")
    getting.set_defaults(handler=run_get)


def run_list(arguments: argparse.Namespace) -> None:
    """Print one row a data set."""
    from rich.table import Table

    from friction_bayes.records.datasets import list_datasets

    table = Table(box=None, padding=(0, 2, 1, 0))
    table.add_column("record", header_style="bold", no_wrap=True)
    for heading in ("parts", "what", "quantity", "licence"):
        table.add_column(heading, header_style="bold")
    for data_set in list_datasets():
        parts = [f"{part} (default)" if part == data_set.default else part for part in data_set.parts]
        table.add_row(
            f"dataset:{data_set.name}", ", ".join(parts), data_set.title, data_set.quantity, data_set.licence
        )
    output_console().print(table)


def run_get(arguments: argparse.Namespace) -> None:
    """Fetch a data set and print where its files lie."""
    from friction_bayes.records.datasets import fetch_dataset

    for path in fetch_dataset(arguments.name.removeprefix("dataset:")):
        output_console().print(str(path), soft_wrap=True)
