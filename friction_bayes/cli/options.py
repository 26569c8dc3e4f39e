"""Options that commands share: the system, the output; and what they turn into."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

from friction_bayes.core.checks import finite_text
from friction_bayes.core.errors import InputError
from friction_bayes.core.system import Oscillator, Pendulum

__all__ = [
    "add_long_run",
    "add_output_folder",
    "add_seed",
    "add_system",
    "completed_by",
    "key_values",
    "one_value_each",
    "options_of",
    "system_of",
]

_SYSTEM_FIELDS = ("mass", "inertia", "stiffness", "mass_sd", "inertia_sd", "stiffness_sd", "trust")


def completed_by(option: argparse.Action, place: str) -> None:
    """Let the shell complete the value of an option by the keys of a table, ``module:NAME``.

    The table is loaded when the tabulator key is pressed, and not for every command.
    """

    def names(**context: Any) -> list[str]:
        module, _, name = place.partition(":")
        return list(getattr(import_module(module), name))

    # where argcomplete looks
    option.completer = names  # type: ignore[attr-defined]


def add_system(parser: argparse.ArgumentParser) -> None:
    """Add SYSTEM: mass or inertia, stiffness, their standard deviations, pendulum or not."""
    group = parser.add_argument_group("system", "a data set brings its own; these then override it")
    group.add_argument("--mass", type=float, metavar="KG", help="moving mass of a linear system")
    group.add_argument(
        "--inertia", type=float, metavar="KG_M2", help="moment of inertia of a rotational system"
    )
    group.add_argument("--stiffness", type=float, metavar="N_PER_M", help="stiffness; N m/rad with --inertia")
    group.add_argument("--mass-sd", type=float, metavar="KG", help="standard deviation of the mass")
    group.add_argument("--inertia-sd", type=float, metavar="KG_M2", help="standard deviation of the inertia")
    group.add_argument(
        "--stiffness-sd", type=float, metavar="N_PER_M", help="standard deviation of the stiffness"
    )
    group.add_argument(
        "--trust",
        choices=("mass", "inertia", "stiffness"),
        help="the value that friction is computed with, where they do not give the frequency found",
    )
    group.add_argument("--pendulum", action="store_true", help="restoring torque is stiffness * sin(angle)")
    group.add_argument("--length", type=float, metavar="M", help="of a simple pendulum, with --mass alone")


def add_output_folder(
    parser: argparse.ArgumentParser, default: str | None = None, *, required: bool = False
) -> None:
    """Add ``--out`` and ``--force``."""
    text = "folder for results and figures" + (f" (default: {default})" if default else "")
    parser.add_argument("--out", metavar="DIR", default=default, required=required, help=text)
    parser.add_argument("--force", action="store_true", help="replace the files of an earlier run")


def add_long_run(parser: argparse.ArgumentParser) -> None:
    """Add ``--resume``, ``--workers`` and ``--scheduler``."""
    group = parser.add_argument_group("fleet", "for one FLEET.zarr in place of records")
    group.add_argument("--resume", action="store_true", help="continue an interrupted run")
    group.add_argument("--workers", type=int, metavar="N", help="processes (default: one per core)")
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="address of a dask.distributed cluster, tcp://..."
    )


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add ``--seed``."""
    parser.add_argument(
        "--seed", type=_seed, default=1, metavar="N", help="seed of all randomness (default: 1)"
    )


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 upwards")
    return int(text)


def system_of(arguments: argparse.Namespace, declared: Oscillator | None = None) -> Oscillator:
    """Build the system from the options, starting from the one a data set declares.

    Raises
    ------
    InputError
        If mass or stiffness are missing or wrong.
    """
    given = {name: value for name in _SYSTEM_FIELDS if (value := getattr(arguments, name)) is not None}
    if arguments.length is not None:
        return Pendulum(length=arguments.length, **given)
    if declared is not None:
        for name in ("mass", "inertia", "stiffness"):
            # The declared spread belongs to the declared value, not to the one that replaces it.
            if name in given and f"{name}_sd" not in given:
                given[f"{name}_sd"] = 0.0
        return replace(declared, **given)
    if arguments.mass is None and arguments.inertia is None:
        raise InputError(
            "system",
            "neither --mass nor --inertia given",
            "give one of them and --stiffness, or --length and --mass of a pendulum",
        )
    if arguments.stiffness is None:
        raise InputError("system", "--stiffness is missing", "give it in N/m, or N m/rad with --inertia")
    return Pendulum(**given) if arguments.pendulum else Oscillator(**given)


def options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the options as parsed, for the manifest."""
    plain = {key: value for key, value in vars(arguments).items() if key != "handler"}
    return {key: str(value) if isinstance(value, Path) else value for key, value in plain.items()}


def key_values(entries: Sequence[str] | None, option: str) -> dict[str, float]:
    """Turn ``KEY=VALUE`` entries into numbers by key.

    Raises
    ------
    InputError
        If an entry has no ``=``, a key comes twice, or a value is not a finite number.
    """
    values: dict[str, float] = {}
    for entry in entries or ():
        key, equals, text = entry.partition("=")
        if not (key and equals):
            raise InputError(option, f"{entry!r} is not KEY=VALUE", "write it like mu=0.1")
        if key in values:
            raise InputError(option, f"{key} is given twice", "give it once")
        values[key] = finite_text(f"{option} {key}", text)
    return values


def one_value_each(arguments: Sequence[str], option: str) -> list[str]:
    """Write an option before each of its ``KEY=VALUE`` entries: what follows is then not one of them."""
    result: list[str] = []
    within = False
    for argument in arguments:
        entry = "=" in argument and not argument.startswith("-")
        if within and entry and result[-1] != option:
            result.append(option)
        within = argument == option or (within and entry)
        result.append(argument)
    return result
