"""What the page is asked for, as the command line and as the Python lines that do the same."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum

__all__ = ["ANSWERS", "SYSTEMS", "Request", "System"]

ANSWERS = {"estimate": "friction, if dry friction alone acts", "close-loop": "what else acts, and friction"}
"""Commands that the page offers, and what each answers."""


@dataclass(frozen=True, kw_only=True)
class System:
    """A way to declare what swings.

    Attributes
    ----------
    pendulum : bool
    fields : mapping of str to str
        Units of what is asked for, by argument of :class:`Oscillator` or :class:`Pendulum`.
    optional : mapping of str to str
        The same of what may be left out.
    """

    pendulum: bool
    fields: Mapping[str, str]
    optional: Mapping[str, str]


SYSTEMS = {
    "mass on a spring": System(
        pendulum=False,
        fields={"mass": "kg", "stiffness": "N/m"},
        optional={"mass_sd": "kg", "stiffness_sd": "N/m"},
    ),
    "rotor on a spring": System(
        pendulum=False,
        fields={"inertia": "kg m2", "stiffness": "N m/rad"},
        optional={"inertia_sd": "kg m2", "stiffness_sd": "N m/rad"},
    ),
    "mass on a string or rod": System(pendulum=True, fields={"mass": "kg", "length": "m"}, optional={}),
    "any other pendulum": System(
        pendulum=True,
        fields={"inertia": "kg m2", "stiffness": "N m"},
        optional={"inertia_sd": "kg m2", "stiffness_sd": "N m"},
    ),
}
"""What may swing, as people call it."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """A file, how it is read, what swings, and which answer is wanted.

    Attributes
    ----------
    file : str
        Name of the record's file, in the current folder.
    reading : mapping
        Arguments of :func:`friction_bayes.read_record`, without those that are left out.
    system : str
        One of :data:`SYSTEMS`.
    values : mapping of str to float or None
        What was entered for it, None where nothing was.
    command : str
        One of :data:`ANSWERS`.
    """

    file: str
    reading: Mapping[str, Any]
    system: str
    values: Mapping[str, float | None]
    command: str

    @property
    def given(self) -> dict[str, float]:
        """What was entered of the system.

        Raises
        ------
        InputError
            If something that it takes was not.
        """
        kind = SYSTEMS[self.system]
        for name, unit in kind.fields.items():
            if self.values.get(name) is None:
                raise InputError(name, f"is not given, and a {self.system} takes it", f"enter it in {unit}")
        named = {name: self.values.get(name) for name in (*kind.fields, *kind.optional)}
        return {name: value for name, value in named.items() if value is not None}

    def declared(self) -> Oscillator:
        """Return the system.

        Raises
        ------
        InputError
            If something is missing or wrong.
        """
        given: dict[str, Any] = self.given
        return Pendulum(**given) if SYSTEMS[self.system].pendulum else Oscillator(**given)

    @property
    def folder(self) -> str:
        """Name of the folder of the result."""
        return "result"

    def arguments(self) -> list[str]:
        """Arguments of ``friction-bayes``.

        Raises
        ------
        InputError
            If something is missing or wrong in the system.
        """
        declared, given = self.declared(), self.given
        if "length" in given:
            given = {"inertia": declared.moving, "stiffness": declared.stiffness}
        chosen = {**given, **self.reading}
        options = [word for name, value in chosen.items() for word in _option(name, value)]
        pendulum = ["--pendulum"] if declared.pendulum else []
        return [self.command, _as_path(self.file), *options, *pendulum, "--out", self.folder]

    def command_line(self) -> str:
        """Return the line for a terminal that does the same."""
        return shlex.join(["friction-bayes", *self.arguments()])

    def python(self) -> str:
        """Return the Python lines that do the same."""
        name = "Pendulum" if SYSTEMS[self.system].pendulum else "Oscillator"
        read = _arguments({"": self.file} | dict(self.reading))
        lines = [
            "import friction_bayes as fb",
            "",
            f"record = fb.read_record({read})",
            f"system = fb.{name}({_arguments(self.given)})",
        ]
        if self.command == "close-loop":
            lines += ["report = fb.close_loop(record, system)", "print(report)"]
        else:
            start = {"start": self.reading["start"]} if "start" in self.reading else {}
            more = f", {_arguments(start)}" if start else ""
            lines += [f"estimate = fb.estimate(record, system{more})", "print(estimate)"]
        return "\n".join(lines)


def _as_path(file: str) -> str:
    """A name that is neither taken for an option nor for a data set."""
    return f"./{file}" if file.startswith(("-", "dataset:")) else file


def _option(name: str, value: Any) -> list[str]:
    """An option with its value, in one word where the value would be taken for an option."""
    option, text = f"--{name.replace('_', '-')}", str(value)
    return [f"{option}={text}"] if text.startswith("-") else [option, text]


def _arguments(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={value!r}" if name else repr(value) for name, value in values.items())
