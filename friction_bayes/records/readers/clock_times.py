"""Times of the day and dates, ``12:03:04.250`` or ``2024-03-01T12:03:04.250``, as seconds from the first.

The day may come before the month, ``1.3.2024 12:03:04``, or after it, ``3/1/2024 12:03:04``. Which it is
matters where a recording goes on beyond midnight alone: then it has to be clear.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np

from friction_bayes.core.arrays import Array

__all__ = ["is_clock_time", "seconds_of_clock_times"]

_CLOCK = re.compile(
    r"(?:(?:(?P<year>\d{4})[-/.](?P<month>\d\d?)[-/.](?P<day>\d\d?)"
    r"|(?P<first>\d\d?)(?P<mark>[-/.])(?P<second>\d\d?)(?P=mark)(?P<last>\d{4})),?[T ])?\s*"
    r"(?P<hours>\d\d?):(?P<minutes>[0-5]\d):(?P<seconds>[0-5]\d(?:[.,]\d*)?)"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|(?P<zone>[+-]\d\d:?\d\d))?"
)
_DAY = 86400.0
_MONTHS = 12


def is_clock_time(cell: str) -> bool:
    """Whether a cell holds a time of the day, with a date or without."""
    return _CLOCK.fullmatch(cell) is not None


def seconds_of_clock_times(cells: Sequence[str]) -> Array | None:
    """Return times of the day, shape (n,), as seconds from the first; None where a cell holds no time.

    Without dates a time that is earlier by more than half a day is one of the next day. So it is where dates
    do not say whether the month or the day comes first.
    """
    found = [each for each in map(_CLOCK.fullmatch, cells) if each is not None]
    if len(found) < len(cells):
        return None
    order = _order_of_dates(found)
    try:
        times = [(_day(each, order), _time(each)) for each in found]
    except ValueError:
        return None
    if len({day is None for day, _ in times}) > 1:
        return None
    first = times[0][0] or 0
    seconds = np.array([((day or 0) - first) * _DAY + time for day, time in times])
    if times[0][0] is None:
        seconds[1:] += _DAY * np.cumsum(np.diff(seconds) < -0.5 * _DAY)
    return seconds - seconds[0]


def _order_of_dates(found: Sequence[re.Match[str]]) -> str:
    """Which of the first two numbers of dates that end in the year is the day; ``unknown`` if none says so.

    There are points between them where the day comes first. A number above twelve is no month, and of a night
    that a recording goes through the number that changes is the day.
    """
    dates = {(each["first"], each["mark"], each["second"]) for each in found if each["last"]}
    firsts, marks, seconds = ({str(date[k]) for date in dates} for k in range(3))
    if "." in marks or any(int(first) > _MONTHS for first in firsts):
        return "day first"
    if any(int(second) > _MONTHS for second in seconds):
        return "month first"
    if len(firsts) > 1 and len(seconds) == 1:
        return "day first"
    return "month first" if len(seconds) > 1 and len(firsts) == 1 else "unknown"


def _day(found: re.Match[str], order: str) -> int | None:
    """Number of the day; None where there is no date, or one that can be read in two ways."""
    if found["year"] is not None:
        year, month, day = found["year"], found["month"], found["day"]
    elif found["last"] is None or order == "unknown":
        return None
    else:
        year, month, day = found["last"], found["first"], found["second"]
        if order == "day first":
            month, day = day, month
    return date(int(year), int(month), int(day)).toordinal()


def _time(found: re.Match[str]) -> float:
    """Seconds since midnight, in universal time where the zone is stated."""
    hours = int(found["hours"])
    if found["half"]:
        hours = hours % 12 + 12 * (found["half"] in "Pp")
    # the zone may change while a recording goes on, where summer time begins or ends
    zone = (found["zone"] or "+0000").replace(":", "")
    minutes = int(found["minutes"]) - 60 * int(zone[:3]) - int(zone[0] + zone[3:])
    return 3600.0 * hours + 60.0 * minutes + float(found["seconds"].replace(",", "."))
