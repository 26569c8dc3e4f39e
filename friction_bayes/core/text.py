"""Numbers and names as people read them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = [
    "duration",
    "fitted_part",
    "interval",
    "interval90",
    "listed",
    "number",
    "of_friction",
    "of_one_sign",
    "percent",
    "set_words",
    "time_span",
    "with_interval",
    "words",
]


_PLAIN = 1e6
"""Numbers below it are read more easily without a power of ten."""
_ALL_DIGITS = 17
"""Significant digits that separate any two numbers in double precision."""


def number(value: float | None, digits: int = 4) -> str:
    """Write a number to some significant digits, below a million without a power of ten; or a dash."""
    if value is None:
        return "–"
    rounded = f"{value:.{digits}g}"
    return f"{float(rounded):.0f}" if 1.0 <= abs(value) < _PLAIN and "e" in rounded else rounded


def interval(low: float | None, high: float | None, digits: int = 4) -> str:
    """Write two numbers, to more digits where they would look the same."""
    for more in range(digits, _ALL_DIGITS + 1):
        ends = number(low, more), number(high, more)
        if ends[0] != ends[1]:
            return " .. ".join(ends)
    return f"{number(low, digits)} .. {number(high, digits)}"


def interval90(summary: Mapping[str, Any], digits: int = 4) -> str:
    """Write the 90 % interval of a summary."""
    low, high = summary["interval90"]
    return interval(low, high, digits)


def with_interval(summary: Mapping[str, Any], digits: int = 5) -> str:
    """Write mean, standard deviation and 90 % interval of a summary."""
    return (
        f"{number(summary['mean'], digits)} {summary['unit']}   sd {number(summary['sd'], 2)}   "
        f"90 %: {interval90(summary, digits)}"
    )


def of_one_sign(interval: Sequence[float]) -> bool:
    """Whether an interval leaves zero out: of a number that may be zero there are no shares."""
    low, high = interval
    return low * high > 0.0


def of_friction(share: float | None, interval: Sequence[float]) -> str:
    """Write a share of friction that lies in an interval; nothing where friction may be zero."""
    return "" if share is None or not of_one_sign(interval) else f", {100.0 * share:.0f} % of friction"


def percent(probability: float) -> str:
    """Write a probability; near 0 and 1 on which side it lies."""
    if probability >= 0.9995:
        return "> 99.9 %"
    return "< 0.1 %" if probability < 5e-4 else f"{100.0 * probability:.1f} %"


def duration(seconds: float) -> str:
    """Write a time."""
    return f"{1e3 * seconds:.1f} ms" if seconds < 1.0 else f"{seconds:.1f} s"


def fitted_part(start: float, end: float, half_cycles: int) -> str:
    """Say which part of a record was fitted, from and to in seconds."""
    return f"fitted {time_span(start, end)}, {half_cycles} half cycles"


def time_span(start: float, end: float, digits: int = 4) -> str:
    """Write from and to in seconds, of a clock far from zero to more digits."""
    furthest, lasting = max(abs(start), abs(end)), end - start
    if furthest and lasting > 0.0:
        digits += max(int(math.log10(furthest / lasting)), 0)
    return f"{number(start, digits)} to {number(end, digits)} s"


_SPELLED = {"presliding": "pre-sliding", "stribeck": "Stribeck"}


def words(name: str) -> str:
    """Write a name of the program, such as ``viscous_damping``, as words."""
    return " ".join(_SPELLED.get(part, part) for part in name.split("_"))


def set_words(effects: Sequence[str]) -> str:
    """Name a set of effects."""
    return " + ".join(map(words, effects)) or "Coulomb friction alone"


def listed(items: Sequence[str], last: str = "and") -> str:
    """Join items to ``a, b and c``."""
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} {last} {items[-1]}"
