"""Errors and warnings; every message names the place, the value and the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import TypeVar

__all__ = [
    "FrictionBayesError",
    "InputError",
    "NotConvergedWarning",
    "RecordWarning",
    "did_you_mean",
    "of_each",
    "unknown_name",
]

_Given = TypeVar("_Given")
_Made = TypeVar("_Made")


_OPTION = re.compile(
    r"(?<![\w-])--(?P<name>[a-z]+(?:-[a-z]+)*)\b(?P<value> (?=[\d.'-]|[A-Z]+\b|(?:first|displacement|m)\b))?"
    r"|(?<![\w/.-])close-loop\b(?![/-]|\.\w)"
)
"""An option of the command line, and whether its value follows; the command that is also a function."""
_IN_PYTHON = {
    "--decay N": "split_decays(record, system)[N - 1]",
    "--decay all": "split_decays(record, system)",
    "--pendulum": "Pendulum(inertia=, stiffness=)",
}
"""What Python has in the place of options that are no arguments of the same name."""


class FrictionBayesError(Exception):
    """Base of every error this package raises on purpose."""


class InputError(FrictionBayesError, ValueError):
    """Bad input or a bad option; the command line turns it into one line and exit status 2.

    Options are written as the command line has them, ``--end 3.9``; the message, as Python reads it, has
    the arguments in their place, ``end=3.9``.

    Parameters
    ----------
    place : str
        Where: a file, a row, an option or an argument.
    problem : str
        What is wrong there, with the offending value.
    remedy : str
        What to do about it.

    Attributes
    ----------
    for_command_line : str
        The message with options.
    """

    def __init__(self, place: str, problem: str, remedy: str) -> None:
        self.for_command_line = f"{place}: {problem}; {remedy}"
        super().__init__(_in_python(self.for_command_line))
        self.place = place
        self.problem = problem
        self.remedy = remedy

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.place, self.problem, self.remedy)


def _in_python(text: str) -> str:
    for option, there in _IN_PYTHON.items():
        text = re.sub(rf"(?<![\w-]){option}\b", there, text)
    return _OPTION.sub(_argument, text)


def _argument(option: re.Match[str]) -> str:
    if option["name"] is None:
        return "close_loop"
    return option["name"].replace("-", "_") + ("=" if option["value"] else "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the known word that is meant, as a question; empty where none is like it."""
    # what goes well does not wait for it
    from difflib import get_close_matches

    likely = get_close_matches(word, list(known), n=1, cutoff=0.75)
    return f" (did you mean {likely[0]}?)" if likely else ""


def unknown_name(place: str, kind: str, name: object, known: Iterable[str]) -> InputError:
    """Return the error of an unknown name: all of them, and the one that is meant."""
    known = list(known)
    problem = f"unknown {kind} {name!r}{did_you_mean(str(name), known)}"
    remedy = f"give {known[0]}" if len(known) == 1 else f"give one of {', '.join(known)}"
    return InputError(place, problem, remedy)


class RecordWarning(UserWarning):
    """Something about a record that the user should know although the estimate can be made.

    Parameters
    ----------
    text : str
        With options as the command line has them; the message has arguments in their place.

    Attributes
    ----------
    for_command_line : str
        The text with options.
    """

    def __init__(self, text: str) -> None:
        self.for_command_line = text
        super().__init__(_in_python(text))


class NotConvergedWarning(UserWarning):
    """A sampler stopped before its diagnostics met their thresholds; the numbers are in the message."""


def of_each(work: Callable[[_Given], _Made], records: Iterable[_Given]) -> list[_Made]:
    """Do the same work with each of several records.

    Raises
    ------
    InputError
        Of all records that are refused, not of the first alone; what is wrong with an option is said once.
    """
    made: list[_Made] = []
    refused: dict[str, InputError] = {}
    for record in records:
        try:
            made.append(work(record))
        except InputError as error:
            refused.setdefault(error.for_command_line, error)
    if len(refused) > 1:
        listed = "; ".join(f"({k}) {text}" for k, text in enumerate(refused, start=1))
        raise InputError(f"{len(refused)} records are refused", listed, "mend these or leave them out")
    for only in refused.values():
        raise only
    return made
