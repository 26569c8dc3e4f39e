"""A local page: a recording is dropped, what was understood is shown and mended, and a command answers."""

from __future__ import annotations

from collections.abc import Callable

from friction_bayes.core.optional import package_of_extra

__all__ = ["start"]


def start(port: int, announce: Callable[[str], object]) -> None:
    """Serve the page to this computer alone, until interrupted.

    Parameters
    ----------
    port : int
        Of its address; zero for any that is free.
    announce : callable
        Takes the address, once it answers.

    Raises
    ------
    InputError
        If Panel is not installed, or the port is in use.
    """
    package_of_extra("panel", place="app", purpose="the local page", extra="app")
    from friction_bayes.app.server import serve

    serve(port, announce)
