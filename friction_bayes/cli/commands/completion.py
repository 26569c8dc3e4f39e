"""``friction-bayes completion``: what a shell evaluates to complete commands and options."""

from __future__ import annotations

import argparse
import sys
from typing import Any

__all__ = ["add_parser"]

_EPILOG = """examples, each a line of the file that the shell reads at its start:
  eval "$(friction-bayes completion bash)"     # ~/.bashrc
  eval "$(friction-bayes completion zsh)"      # ~/.zshrc, after compinit
  friction-bayes completion fish | source      # ~/.config/fish/config.fish
"""


def add_parser(commands: Any) -> None:
    """Add ``completion SHELL``."""
    parser = commands.add_parser(
        "completion",
        help="code that lets a shell complete commands, options and files",
        description="Print the code that lets a shell complete commands, options and files.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("shell", metavar="SHELL", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")
    parser.set_defaults(handler=run)


def run(arguments: argparse.Namespace) -> None:
    """Print it."""
    from argcomplete import shellcode

    sys.stdout.write(shellcode(["friction-bayes"], shell=arguments.shell))
