"""Effects of one's own on the command line: ``--register MODULE:EFFECT``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from friction_bayes.core.errors import InputError

__all__ = ["add_register", "register_effects"]


def add_register(parser: argparse._ActionsContainer) -> None:
    """Add ``--register``."""
    parser.add_argument(
        "--register",
        action="append",
        metavar="MODULE:EFFECT",
        help="add an effect of your own to the catalogue; may be repeated",
    )


def register_effects(entries: Sequence[str] | None) -> None:
    """Import each module, from the current folder too, and add its effect to the catalogue.

    An effect that its module has registered by itself is taken as it is.

    Raises
    ------
    InputError
        If an entry is not ``MODULE:EFFECT``, the module cannot be imported, or what it names is no effect.
    """
    if not entries:
        return
    # the catalogue loads numba, which the other runs need not wait for here
    from friction_bayes.mechanics.effects import EFFECTS, Effect, register

    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    for entry in entries:
        module, _, name = entry.partition(":")
        if not (module and name):
            raise InputError("--register", f"{entry!r} is not MODULE:EFFECT", "write it like my_effects:BUMP")
        try:
            effect = getattr(import_module(module), name, None)
        # whatever a module of the user raises is a fault of that module
        except Exception as error:
            raise InputError(
                "--register",
                f"{module} cannot be imported ({type(error).__name__}: {error})",
                "run in the folder of the module, or install it",
            ) from error
        if not isinstance(effect, Effect):
            raise InputError("--register", f"{name} of {module} is no effect", "name an Effect of the module")
        if EFFECTS.get(effect.name) is not effect:
            register(effect)
