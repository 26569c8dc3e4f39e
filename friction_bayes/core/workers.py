"""Independent pieces of work, spread over processes of this machine or over a cluster."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import TypeVar

from friction_bayes.core.errors import InputError

__all__ = ["for_each"]

_Item = TypeVar("_Item")


def for_each(
    function: Callable[[_Item], object],
    items: Sequence[_Item],
    *,
    scheduler: str | None,
    workers: int,
    done: Callable[[], object],
) -> None:
    """Call a function with each item, for what it leaves behind.

    Items are handed out one by one. Where a worker dies, what it had in hand is done by another one.

    Parameters
    ----------
    function : callable
        Pickled with each item, so it holds little. What it returns is ignored.
    items : sequence
    scheduler : str or None
        Address of a dask.distributed scheduler, whose workers see the same files; ``workers`` are not asked
        for then.
    workers : int
        Processes of this machine; with one everything is done in this process.
    done : callable
        Called after each item.

    Raises
    ------
    InputError
        If no scheduler answers.
    """
    if not items:
        return
    workers = min(workers, len(items))
    if scheduler is None and workers <= 1:
        for item in items:
            function(item)
            done()
        return
    from dask.distributed import Client, LocalCluster, as_completed

    with ExitStack() as stack:
        # processes, not threads: a sampler's steps in Python would wait for each other
        cluster = scheduler or stack.enter_context(
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=None,
                dashboard_address=None,
                # any free port: another run has its own
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
                # an error is raised here, and is not for a worker to print
                silence_logs=logging.CRITICAL,
            )
        )
        try:
            client = stack.enter_context(Client(cluster, timeout=10, set_as_default=False))
        except (OSError, ValueError) as error:
            raise InputError("--scheduler", f"{scheduler} does not answer ({error})", "start it") from None
        for future in as_completed(client.map(function, items, pure=False), loop=client.loop):
            future.result()
            done()
