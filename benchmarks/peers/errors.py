"""A row of a comparison of estimates with their truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.peers.measuring import bold, over
from friction_bayes.core.errors import InputError

__all__ = ["ERRORS", "TIMES", "errors_and_times", "friction_or_inf"]

ERRORS = ("friction error, median", "90th percentile", "within 10 %")
TIMES = ("ms a record", "time over ours")
_WITHIN = 0.1


def friction_or_inf(found: Callable[[], float]) -> float:
    """What a method finds, infinite where it refuses a record."""
    try:
        return found()
    except InputError:
        return float("inf")


def _short(value: float) -> str:
    """A number with two digits, and more before the point where it has them."""
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def errors_and_times(
    errors: Mapping[str, Sequence[float]], times: Mapping[str, Sequence[float]], ours: Sequence[str]
) -> dict[str, list[str]]:
    """By method, texts of the columns :data:`ERRORS` and :data:`TIMES`; in bold what does better than ours.

    Parameters
    ----------
    errors, times : mapping
        Relative errors and seconds, a value a record, by method.
    ours : sequence of str
        The method that all are compared with, and others of this package.
    """
    figures = {}
    for name, each in errors.items():
        size = np.abs(each)
        figures[name] = [
            100.0 * q for q in (*np.quantile(size, (0.5, 0.9), method="higher"), np.mean(size <= _WITHIN))
        ]
    best, texts = figures[ours[0]], {}
    for name, (middle, far, within) in figures.items():
        ratio = over(times[name], times[ours[0]])
        peer = name not in ours
        better = [peer and each for each in (middle < best[0], far < best[1], within > best[2], ratio < 1.0)]
        shown = [f"{_short(middle)} %", f"{_short(far)} %", f"{within:.0f} %"]
        shown += [_short(1e3 * float(np.median(times[name]))), _short(ratio)]
        texts[name] = [bold(text, mark) for text, mark in zip(shown, [*better, better[-1]], strict=True)]
    return texts
