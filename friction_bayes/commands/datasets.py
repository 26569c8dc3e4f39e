"""``friction-bayes datasets``: the measured sets one can ask for by name."""

from __future__ import annotations

import argparse
from typing import Any

__all__ = ["add_parser"]


def add_parser(commands: Any) -> None:
    """Add ``datasets list`` and ``datasets get NAME``."""
    parser = commands.add_parser("datasets", help="list measured data sets, or fetch one", allow_abbrev=False)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    listing = actions.add_parser("list", help="names, what was measured, licence", allow_abbrev=False)
    listing.set_defaults(run=run_list)
    getting = actions.add_parser("get", help="download a set and check its digests", allow_abbrev=False)
    getting.add_argument("name", metavar="NAME", help="as in the list, without dataset:")
    getting.set_defaults(run=run_get)


def run_list(arguments: argparse.Namespace) -> None:
    """Print one row a data set."""


def run_get(arguments: argparse.Namespace) -> None:
    """Fetch a data set and print where its files lie."""
