"""Curtailed counts: records after those that settle a verdict are not computed, the verdict is the same."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

__all__ = ["at_least"]


def at_least(count: int, outcomes: Iterable[bool]) -> bool:
    """Whether so many of the outcomes are true; none after the last that is needed is looked at."""
    return sum(1 for _ in islice(filter(None, outcomes), count)) == count
