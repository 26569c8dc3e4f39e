"""Packages that only some formats need."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType

from friction_bayes.core.errors import InputError

__all__ = ["optional_package"]


def optional_package(name: str, path: Path) -> ModuleType:
    """Import a package of the ``formats`` extra, or say how to get it.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError:
        raise InputError(
            str(path),
            f"reading {path.suffix} needs the package {name}, which is not installed",
            'install it with pip install "friction-bayes[formats]"',
        ) from None
