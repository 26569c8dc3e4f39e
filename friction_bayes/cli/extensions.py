"""Effects and estimators of one's own on the command line: ``--register MODULE:EFFECT``."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from friction_bayes.core.errors import InputError, RecordWarning

__all__ = ["add_register", "note_effects_without_part", "register_extensions"]


def add_register(parser: argparse._ActionsContainer) -> None:
    """Add ``--register``."""
    parser.add_argument(
        "--register",
        action="append",
        metavar="MODULE:EFFECT",
        help="add an effect of your own to the catalogue, or an estimator to the methods; may be repeated",
    )


def register_extensions(entries: Sequence[str] | None) -> list[str]:
    """Import each module, from the current folder too, and add its effect to the catalogue.

    An estimator is added to the methods. What its module has registered by itself is taken as it is.

    Returns
    -------
    list of str
        Names of the effects.

    Raises
    ------
    InputError
        If an entry is not ``MODULE:EFFECT``, the module cannot be imported, or what it names is neither an
        effect nor an estimator.
    """
    if not entries:
        return []
    # the catalogue loads numba, which the other runs need not wait for here
    from friction_bayes.estimators.base import Estimator
    from friction_bayes.estimators.registry import register as register_estimator
    from friction_bayes.mechanics.effects import EFFECTS, Effect, register

    effects = []
    for entry in entries:
        found = _imported(entry)
        if isinstance(found, Effect):
            if EFFECTS.get(found.name) is not found:
                register(found)
            effects.append(found.name)
        elif isinstance(found, Estimator):
            register_estimator(found)
        else:
            module, _, name = entry.partition(":")
            raise InputError("--register", f"{name} of {module} is no effect", "name an Effect of the module")
    return effects


def note_effects_without_part(effects: Sequence[str], command: str) -> None:
    """Warn of effects given to a command that fits dry friction alone."""
    for name in effects:
        warnings.warn(
            f"{name} plays no part: {command} fits dry friction alone; close-loop evaluates effects",
            RecordWarning,
            stacklevel=2,
        )


def _imported(entry: str) -> Any:
    """Return what ``MODULE:NAME`` names, None where the module has nothing of that name."""
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    module, _, name = entry.partition(":")
    if not (module and name):
        raise InputError("--register", f"{entry!r} is not MODULE:EFFECT", "write it like my_effects:BUMP")
    try:
        return getattr(import_module(module), name, None)
    # whatever a module of the user raises is a fault of that module
    except Exception as error:
        raise InputError(
            "--register",
            f"{module} cannot be imported ({type(error).__name__}: {error})",
            "run in the folder of the module, or install it",
        ) from error
