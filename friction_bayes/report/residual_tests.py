"""Tests of the residual, named by what they examine: few of many, the same ones wherever they are named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from friction_bayes.core.text import listed, words

__all__ = ["MOST_SHOWN", "failures", "meaning", "shown_tests"]

MOST_SHOWN = 7
"""Tests that a page names at most."""
_MOST_IN_A_LINE = 3

_MEANINGS = {
    "whiteness": "correlation between samples",
    "spectrum": "lines in the spectrum",
    "tails": "outliers",
    "force_by_velocity": "random force against velocity",
    "force_by_position": "random force against position",
    "friction_by_position": "friction in one tenth of the travel",
    "force_by_stop": "a spring that begins at one position",
    "force_by_amplitude": "random force against amplitude",
    "force_by_time": "random force over time",
    "force_jumps": "jumps of the random force",
}


def meaning(name: str) -> str:
    """What a test examines; its name where it is not one of ours."""
    return _MEANINGS.get(name, words(name))


def failures(names: Sequence[str]) -> str:
    """Name tests that fail by what they examine, the first few and how many more."""
    shown = [meaning(name) for name in names[:_MOST_IN_A_LINE]]
    left = len(names) - len(shown)
    return listed([*shown, f"{left} more"] if left else shown)


def shown_tests(residual: Mapping[str, Any]) -> list[str]:
    """The tests that a table names: those that a line names first, then what fails, then the others.

    Parameters
    ----------
    residual : mapping
        ``residual`` of a report.
    """
    before, after = residual["before"], residual["after"]
    ordered = [
        *after["failed"][:_MOST_IN_A_LINE],
        *before["failed"][:_MOST_IN_A_LINE],
        *after["failed"],
        *before["failed"],
        *before["channels"],
        *after["channels"],
    ]
    return list(dict.fromkeys(ordered))[:MOST_SHOWN]
