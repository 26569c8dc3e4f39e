"""The first use of the kernels, which compiles them: how a caller hears of it, and how it takes less."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event

__all__ = ["compilation_announced"]


class _Compilation(event.Listener):
    """Calls back at the first kernel that is not found on disk.

    Meanwhile nothing is searched for dead objects: a sixth of the time of compiling, for next to nothing.
    """

    def __init__(self, announce: Callable[[], None]) -> None:
        self._announce = announce
        self._announced = False
        self._within = 0

    def on_start(self, event: event.Event) -> None:
        if not self._announced:
            self._announced = True
            self._announce()
        self._within += 1
        gc.disable()

    def on_end(self, event: event.Event) -> None:
        # kernels that it calls are compiled within
        self._within -= 1
        if self._within == 0:
            gc.enable()


@contextmanager
def compilation_announced(announce: Callable[[], None]) -> Iterator[None]:
    """Call ``announce`` once if a kernel is compiled within this context rather than loaded from disk.

    Parameters
    ----------
    announce : callable
        Takes nothing.
    """
    with event.install_listener("numba:compile", _Compilation(announce)):
        yield
