"""``friction-bayes app``: a local page on which a recording is dropped."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from friction_bayes.app import start

__all__ = ["add_parser"]

_PORT = 5006
_EPILOG = """example:
  friction-bayes app --port 5006
"""


def add_parser(commands: Any) -> None:
    """Add ``app``."""
    parser = commands.add_parser(
        "app",
        help="a local page: drop a recording, see what was understood, get the answer",
        description="Serve a page to this computer alone, until interrupted: drop a recording, see and "
        "correct what was understood of it, enter what swings, and get the answer with its report. Nothing "
        "is sent anywhere. Takes the extra app.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "--port", type=_port, default=_PORT, metavar="N", help=f"of the page's address (default: {_PORT})"
    )
    parser.set_defaults(handler=run)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port, 0 to 65535")
    return int(text)


def run(arguments: argparse.Namespace) -> None:
    """Serve until interrupted."""
    start(arguments.port, _announce)


def _announce(address: str) -> None:
    sys.stdout.write(f"open {address} in a browser; Ctrl-C ends\n")
    sys.stdout.flush()
