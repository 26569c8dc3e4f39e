"""``friction-bayes demo``: every estimator on two synthetic records, checked by emcee, and a closed loop."""

from __future__ import annotations

import argparse
from typing import Any

from friction_bayes.cli.options import add_output_folder, add_seed

__all__ = ["add_parser"]

_EPILOG = """example:
  friction-bayes demo --out friction_bayes_demo --force
"""


def add_parser(commands: Any) -> None:
    """Add ``demo``."""
    parser = commands.add_parser(
        "demo",
        help="every estimator on two synthetic records, and a closed loop, in under a minute",
        description="Estimate friction on the paper's numerical example and on a synthetic testbed record "
        "with viscous damping in it, by every estimator, each checked by emcee, and close the loop on the "
        "latter.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add_seed(parser)
    add_output_folder(parser, default="friction_bayes_demo")
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Make the records, estimate, check, close the loop, draw and print."""
    # It takes emcee, ArviZ and matplotlib, which no other command needs to wait for.
    from friction_bayes.cli.demonstration import demonstrate

    demonstrate(arguments)
