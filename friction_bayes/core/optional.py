"""Packages that an extra of the installation brings."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from friction_bayes.core.errors import InputError

__all__ = ["package_of_extra"]


def package_of_extra(name: str, *, place: str, purpose: str, extra: str) -> ModuleType:
    """Import a package of an extra, or say how to get it.

    Parameters
    ----------
    name : str
        Of the package.
    place : str
        Where it is needed, such as a file.
    purpose : str
        What for, as in "reading .tdms".
    extra : str
        The extra that brings it.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError:
        raise InputError(
            place,
            f"{purpose} needs the package {name}, which is not installed",
            f'install it with pip install ".[{extra}]" in the checkout',
        ) from None
