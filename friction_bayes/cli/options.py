"""Options that commands share: the system, the record, the output; and what they turn into."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import friction_bayes as fb
from friction_bayes.core.checks import finite
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import sha256_of
from friction_bayes.core.system import Oscillator, Pendulum

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "add_long_run",
    "add_output_folder",
    "add_record",
    "add_seed",
    "add_system",
    "input_digests",
    "key_values",
    "load_record",
    "load_records",
    "one_value_each",
    "options_of",
    "system_of",
]

_DATASET = "dataset:"
_RECORD_FIELDS = (
    "quantity",
    "unit",
    "scale",
    "time_column",
    "signal_column",
    "sampling_rate",
    "resample",
    "run",
)
_SYSTEM_FIELDS = ("mass", "inertia", "stiffness", "mass_sd", "inertia_sd", "stiffness_sd", "trust")


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


def add_record(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how a record file is read."""
    group = parser.add_argument_group("record", "what the column names of the file do not say")
    group.add_argument("--time-column", metavar="NAME", help="sample times [s], by name or number from 0")
    group.add_argument("--signal-column", metavar="NAME", help="signal, by name or number from 0")
    group.add_argument("--quantity", metavar="NAME", help="displacement, velocity, acceleration, angle, ...")
    group.add_argument(
        "--unit", metavar="UNIT", help="unit of the signal; V, counts or a.u. when not calibrated"
    )
    group.add_argument(
        "--scale",
        type=float,
        metavar="FACTOR",
        help="factor from the numbers of the file to --unit; with a --unit such as mV/g, the sensitivity",
    )
    group.add_argument("--sampling-rate", type=float, metavar="HZ", help="for a record without a time column")
    group.add_argument(
        "--resample", action="store_true", help="interpolate a non-uniform record to a uniform rate"
    )
    group.add_argument(
        "--run", type=int, metavar="N", help="run, in a file of several such as PASCO Capstone's"
    )


def add_output_folder(
    parser: argparse.ArgumentParser, default: str | None = None, *, required: bool = False
) -> None:
    """Add ``--out`` and ``--force``."""
    text = "folder for results and figures" + (f" (default: {default})" if default else "")
    parser.add_argument("--out", metavar="DIR", default=default, required=required, help=text)
    parser.add_argument("--force", action="store_true", help="replace the files of an earlier run")


def add_long_run(parser: argparse._ActionsContainer) -> None:
    """Add ``--resume``, ``--workers`` and ``--scheduler``."""
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run")
    parser.add_argument("--workers", type=int, metavar="N", help="threads (default: one per core)")
    parser.add_argument(
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
    if declared is not None:
        for name in ("mass", "inertia", "stiffness"):
            # The declared spread belongs to the declared value, not to the one that replaces it.
            if name in given and f"{name}_sd" not in given:
                given[f"{name}_sd"] = 0.0
        return replace(declared, **given)
    if arguments.mass is None and arguments.inertia is None:
        raise InputError("system", "neither --mass nor --inertia given", "give one of them and --stiffness")
    if arguments.stiffness is None:
        raise InputError("system", "--stiffness is missing", "give it in N/m, or N m/rad with --inertia")
    return Pendulum(**given) if arguments.pendulum else Oscillator(**given)


def load_record(source: str, arguments: argparse.Namespace) -> tuple[xr.DataArray, Oscillator]:
    """Read a record file, or fetch a data set with its system.

    Parameters
    ----------
    source : str
        A file, or ``dataset:NAME[/PART]``.
    arguments : argparse.Namespace
        Options of :func:`add_system` and :func:`add_record`.

    Returns
    -------
    record : xarray.DataArray
    system : Oscillator
    """
    if source.startswith(_DATASET):
        for name in _RECORD_FIELDS:
            value = getattr(arguments, name)
            if value is not None and value is not False:
                option = f"--{name.replace('_', '-')}"
                raise InputError(
                    option, f"does not apply to {source}", "a data set brings its own; leave it out"
                )
        record, declared = fb.dataset_record(source.removeprefix(_DATASET))
        system = system_of(arguments, declared)
        if system != declared:
            record.attrs["system_source"] = "given on the command line, in part or whole"
        return record, system
    system = system_of(arguments)
    return fb.read_record(source, **{name: getattr(arguments, name) for name in _RECORD_FIELDS}), system


def load_records(
    sources: Sequence[str], arguments: argparse.Namespace
) -> tuple[list[xr.DataArray], Oscillator]:
    """Read several records of one system.

    Parameters
    ----------
    sources : sequence of str
        As for :func:`load_record`.
    arguments : argparse.Namespace
        Options of :func:`add_system` and :func:`add_record`.

    Returns
    -------
    records : list of xarray.DataArray
    system : Oscillator

    Raises
    ------
    InputError
        If a record is given twice, or two are of different systems.
    """
    for source in sources:
        if sources.count(source) > 1:
            raise InputError(source, "is given twice", "give each record once")
    records, systems = zip(*(load_record(source, arguments) for source in sources), strict=True)
    for source, system in zip(sources, systems, strict=True):
        if system != systems[0]:
            raise InputError(
                source, f"is of another system than {sources[0]}", "give records of one system together"
            )
    return list(records), systems[0]


def input_digests(*sources: str | None) -> dict[str, str]:
    """Return the sha256 digest of every record that was read, by its name."""
    digests = {}
    for source in sources:
        if source is None:
            continue
        name, _, part = source.removeprefix(_DATASET).partition("/")
        if source.startswith(_DATASET):
            from friction_bayes.records import datasets

            data_set = datasets.DATASETS[name]
            digests[source] = data_set.files[data_set.parts[part or data_set.default].file].sha256
        else:
            digests[source] = sha256_of(Path(source))
    return digests


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
        values[key] = finite(f"{option} {key}", text)  # type: ignore[arg-type]
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
