"""Times of the day and dates, ``12:03:04.250`` or ``2024-03-01T12:03:04.250``, as seconds from the first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["is_clock_time", "seconds_from_first"]

_CLOCK = re.compile(
    r"(?:(?P<year>\d{4})[-/.](?P<month>\d\d?)[-/.](?P<day>\d\d?)[T ])?\s*"
    r"(?P<hours>\d\d?):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d(?:[.,]\d*)?)"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
_DAY = 86400.0


def is_clock_time(cell: str) -> bool:
    """Whether a cell holds a time of the day, with a date (year first) or without."""
    return _CLOCK.fullmatch(cell) is not None


def seconds_from_first(cells: Sequence[str]) -> Array | None:
    """Return times of the day, shape (n,), as seconds from the first; None where a cell is none.

    Without dates a time that is earlier by more than half a day is one of the next day.
    """
    found = [_CLOCK.fullmatch(cell) for cell in cells]
    try:
        times = [_time(each) for each in found if each is not None]
    except ValueError:
        return None
    if len(times) < len(cells) or len({day is None for day, _ in times}) > 1:
        return None
    first = times[0][0] or 0
    seconds = np.array([((day or 0) - first) * _DAY + time for day, time in times])
    if times[0][0] is None:
        seconds[1:] += _DAY * np.cumsum(np.diff(seconds) < -0.5 * _DAY)
    return seconds - seconds[0]


def _time(found: re.Match[str]) -> tuple[int | None, float]:
    """Day, where there is a date, and seconds since midnight; a shift of the time zone is left out."""
    hours = int(found["hours"])
    if found["half"]:
        hours = hours % 12 + 12 * (found["half"] in "Pp")
    time = 3600.0 * hours + 60.0 * int(found["minutes"]) + float(found["seconds"].replace(",", "."))
    if found["year"] is None:
        return None, time
    return date(int(found["year"]), int(found["month"]), int(found["day"])).toordinal(), time
