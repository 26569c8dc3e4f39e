"""TDMS files of LabVIEW."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError, RecordWarning
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table
from friction_bayes.records.record import seconds_from_first

__all__ = ["read_tdms"]


def read_tdms(path: Path) -> Table:
    """Read the channels of a TDMS file, named ``group/channel``, with waveform timing if it has any.

    Parameters
    ----------
    path : Path
        The file.
    """
    nptdms = optional_package("nptdms", path)
    try:
        with _complaints() as heard:
            file = nptdms.TdmsFile.read(path)
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a TDMS file ({error})", "give the suffix of its format"
        ) from None
    if heard:
        warnings.warn(
            f"{path.name}: the file is damaged or ends too soon: what could be read of it is taken",
            RecordWarning,
            stacklevel=2,
        )
    columns = {}
    for group in file.groups():
        for channel in group.channels():
            if channel.dtype.kind not in "fiuM":
                continue
            stamps = channel.dtype.kind == "M"
            columns[f"{group.name}/{channel.name}"] = Column(
                partial(_samples, channel),
                since=str(channel[0]) if stamps and len(channel) else None,
                unit=channel.properties.get("unit_string") or None,
                clock=_clock(channel.properties, len(channel)),
            )
    return Table(columns)


def _samples(channel: Any) -> NDArray[Any]:
    """The samples of a channel, time stamps as seconds from the first."""
    return np.asarray(seconds_from_first(channel[:]))


@contextmanager
def _complaints() -> Iterator[list[logging.LogRecord]]:
    """Yield a list of what the library would say on standard error of what it misses and goes on without."""
    from nptdms.log import log_manager

    heard: list[logging.LogRecord] = []

    class Listener(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            heard.append(record)

    listener, console = Listener(), log_manager.console_handler
    loggers = list(log_manager.loggers.values())
    for logger in loggers:
        logger.addHandler(listener)
        logger.removeHandler(console)
    try:
        yield heard
    finally:
        for logger in loggers:
            logger.removeHandler(listener)
            logger.addHandler(console)


def _clock(properties: Mapping[str, Any], samples: int) -> Callable[[], Array] | None:
    """Return the times of a waveform, None for other channels; LabVIEW leaves an offset of zero out."""
    if "wf_increment" not in properties:
        return None
    return lambda: properties.get("wf_start_offset", 0.0) + properties["wf_increment"] * np.arange(samples)
