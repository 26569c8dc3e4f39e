"""One thread of BLAS at a time: its threads spin while they wait, and the matrices here are small."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock

# NumPy and SciPy each bring a BLAS of their own; both are loaded before they are looked for
import numpy as np  # noqa: F401
import scipy.linalg  # noqa: F401
from threadpoolctl import ThreadpoolController

__all__ = ["single_threaded_blas"]


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Hold BLAS to one thread around work of this package; a decorator too.

    Calls may be nested, and may overlap in several threads. Most libraries have one limit for the whole
    process: the first call sets it and the last one to leave puts back what was there, so that other threads
    are held to it meanwhile. An OpenBLAS on OpenMP has one limit a thread, which each call sets for its own.
    """
    of_process, of_thread = _libraries()
    # the outer one as a context, which also lets other threads set limits again (threadpoolctl 3.8: a thread
    # that has set one keeps that right until the last of its contexts ends)
    with of_thread.limit(limits=1, user_api="blas"), _SHARED.held(of_process):
        yield


class _SharedLimit:
    """A limit common to all threads: the first holder sets it, the last one lifts it."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._holders = 0

    @contextmanager
    def held(self, libraries: ThreadpoolController) -> Iterator[None]:
        with self._lock:
            if self._holders == 0:
                self._limit = libraries.limit(limits=1, user_api="blas")
            self._holders += 1
        try:
            yield
        finally:
            with self._lock:
                self._holders -= 1
                if self._holders == 0:
                    self._limit.restore_original_limits()


_SHARED = _SharedLimit()


@cache
def _libraries() -> tuple[ThreadpoolController, ThreadpoolController]:
    """Libraries of BLAS with one limit for the process, and those with one a thread; looked for once."""
    every = ThreadpoolController()
    a_thread = every.select(internal_api="openblas").select(threading_layer="openmp")
    others = [each.filepath for each in every.lib_controllers if each not in a_thread.lib_controllers]
    return every.select(filepath=others), a_thread
