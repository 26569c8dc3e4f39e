"""How many threads BLAS takes in this process."""

from __future__ import annotations

from threading import Thread

import numpy as np  # noqa: F401
import scipy.linalg  # noqa: F401  (its BLAS is not NumPy's)
from threadpoolctl import ThreadpoolController, threadpool_info

__all__ = ["blas_threads", "set_blas_threads"]


def blas_threads() -> set[int]:
    """Threads that the libraries of BLAS would take."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def set_blas_threads(number: int) -> None:
    """Set them for good.

    By a thread that ends: for threadpoolctl, the thread that has set a limit is the only one to set another
    as long as it lives.
    """
    thread = Thread(target=lambda: ThreadpoolController().limit(limits=number, user_api="blas"))
    thread.start()
    thread.join()
