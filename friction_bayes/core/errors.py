"""Errors and warnings; every message names the place, the value and the remedy."""

from __future__ import annotations

__all__ = ["FrictionBayesError", "InputError", "NotConvergedWarning", "RecordWarning"]


class FrictionBayesError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(FrictionBayesError, ValueError):
    """Bad input or a bad option; the command line turns it into one line and exit status 2.

    Parameters
    ----------
    place : str
        Where: a file, a row, an option or an argument.
    problem : str
        What is wrong there, with the offending value.
    remedy : str
        What to do about it.
    """

    def __init__(self, place: str, problem: str, remedy: str) -> None:
        super().__init__(f"{place}: {problem}; {remedy}")
        self.place = place
        self.problem = problem
        self.remedy = remedy

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.place, self.problem, self.remedy)


class RecordWarning(UserWarning):
    """Something about a record that the user should know although the estimate can be made."""


class NotConvergedWarning(UserWarning):
    """A sampler stopped before its diagnostics met their thresholds; the numbers are in the message."""
