"""Packages that only some formats need."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from friction_bayes.core.optional import package_of_extra

__all__ = ["optional_package"]


def optional_package(name: str, path: Path) -> ModuleType:
    """Import a package of the ``formats`` extra, or say how to get it.

    Raises
    ------
    InputError
        If it is not installed.
    """
    return package_of_extra(name, place=str(path), purpose=f"reading {path.suffix}", extra="formats")
