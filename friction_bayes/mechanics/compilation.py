"""The first use of the kernels, which compiles them: how a caller may hear of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event

__all__ = ["compilation_announced"]


class _FirstCompilation(event.Listener):
    """Calls back at the first kernel that is not found on disk."""

    def __init__(self, announce: Callable[[], None]) -> None:
        self._announce = announce
        self._announced = False

    def on_start(self, event: event.Event) -> None:
        if not self._announced:
            self._announced = True
            self._announce()

    def on_end(self, event: event.Event) -> None:
        pass


@contextmanager
def compilation_announced(announce: Callable[[], None]) -> Iterator[None]:
    """Call ``announce`` once if a kernel is compiled within this context rather than loaded from disk.

    Parameters
    ----------
    announce : callable
        Takes nothing.
    """
    with event.install_listener("numba:compile", _FirstCompilation(announce)):
        yield
