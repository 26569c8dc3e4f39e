"""Records on the command line: the options that say how a file is read, and what was understood of it."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import friction_bayes as fb
from friction_bayes.cli.extensions import add_register
from friction_bayes.cli.options import completed_by, system_of
from friction_bayes.core.errors import InputError, of_each
from friction_bayes.core.files import sha256_of
from friction_bayes.core.system import Oscillator

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "EACH_DECAY",
    "OPTIONS_OF_A_RECORD",
    "add_record",
    "input_digests",
    "load_decays",
    "load_records",
    "refuse_twice",
    "what_was_read_of_each",
]

EACH_DECAY = "all"
"""What ``--decay`` is for all decays of a recording."""

_DATASET = "dataset:"
_RECORD_FIELDS = (
    "quantity",
    "unit",
    "scale",
    "time_column",
    "signal_column",
    "sampling_rate",
    "run",
    "skip_rows",
    "duplicates",
)
OPTIONS_OF_A_RECORD = (*_RECORD_FIELDS, "start", "end", "decay", "register")
"""What a fleet, whose attributes and coordinates say it all, does not have."""


def add_record(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how a record file is read."""
    group = parser.add_argument_group("record", "what the column names of the file do not say")
    group.add_argument("--time-column", metavar="NAME", help="sample times [s], by name or number from 0")
    group.add_argument("--signal-column", metavar="NAME", help="signal, by name or number from 0")
    quantity = group.add_argument(
        "--quantity", metavar="NAME", help="displacement, velocity, acceleration, angle, ..."
    )
    completed_by(quantity, "friction_bayes.core.quantities:QUANTITIES")
    group.add_argument(
        "--unit", metavar="UNIT", help="unit of the signal; V, counts, px or a.u. when not calibrated"
    )
    group.add_argument(
        "--scale",
        type=float,
        metavar="FACTOR",
        help="factor from the numbers of the file to --unit; with a --unit such as mV/g, the sensitivity",
    )
    group.add_argument("--sampling-rate", type=float, metavar="HZ", help="for a record without a time column")
    group.add_argument(
        "--run", type=int, metavar="N", help="run, in a file of several such as PASCO Capstone's"
    )
    group.add_argument(
        "--skip-rows",
        type=_rows,
        metavar="N",
        help="lines above the table, where they are not recognised",
    )
    group.add_argument(
        "--duplicates",
        choices=("first", "mean"),
        help="what to take of samples with one time stamp; they are refused otherwise",
    )
    group.add_argument(
        "--start",
        type=float,
        metavar="S",
        help="take the record from here on; the motion is free from then on",
    )
    group.add_argument("--end", type=float, metavar="S", help="take the record up to here")
    group.add_argument(
        "--decay",
        type=_decay,
        metavar="N|all",
        help="free decay, in a recording of several, counted from 1, or each of them",
    )
    add_register(group)


def _rows(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of lines")
    return int(text)


def _decay(text: str) -> int | str:
    if text == EACH_DECAY:
        return text
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is neither a number from 1 upwards nor {EACH_DECAY}")
    return int(text)


def load_decays(source: str, arguments: argparse.Namespace) -> tuple[list[xr.DataArray], Oscillator]:
    """Read a record file, or fetch a data set with its system, and take what ``--decay`` says of it.

    Parameters
    ----------
    source : str
        A file, or ``dataset:NAME[/PART]``.
    arguments : argparse.Namespace
        Options of :func:`~friction_bayes.cli.options.add_system` and :func:`add_record`.

    Returns
    -------
    decays : list of xarray.DataArray
        The whole record without ``--decay``.
    system : Oscillator
    """
    # what reads numbers takes a second to load, which refused options need not wait for
    from friction_bayes.cli.declared_units import check_declared_units
    from friction_bayes.records.clock import check_time_unit
    from friction_bayes.records.record import within

    if source.startswith(_DATASET):
        for name in _RECORD_FIELDS:
            value = getattr(arguments, name)
            if value is not None:
                option = f"--{name.replace('_', '-')}"
                raise InputError(
                    option, f"does not apply to {source}", "a data set brings its own; leave it out"
                )
        record, declared = fb.dataset_record(source.removeprefix(_DATASET))
        record = record[within(record, arguments.start, arguments.end)]
        system = system_of(arguments, declared)
        if system != declared:
            record.attrs["system_source"] = "given on the command line, in part or whole"
        return _chosen_decays(record, system, arguments.decay), system
    system = system_of(arguments)
    stated = {name: getattr(arguments, name) for name in (*_RECORD_FIELDS, "start", "end")}
    record = fb.read_record(source, **{name: value for name, value in stated.items() if value is not None})
    check_declared_units(record, system)
    check_time_unit(record, system.natural_frequency)
    return _chosen_decays(record, system, arguments.decay), system


def _chosen_decays(record: xr.DataArray, system: Oscillator, chosen: int | str | None) -> list[xr.DataArray]:
    """Return the decay of that number, each of them, or the whole record where none is chosen."""
    if chosen is None:
        return [record]
    decays = fb.split_decays(record, system)
    if len(decays) > 1:
        decays = [
            decay.assign_attrs(read=f"{decay.attrs['read']}, decay {k} of {len(decays)}")
            for k, decay in enumerate(decays, start=1)
        ]
    if isinstance(chosen, str):
        return decays
    if chosen > len(decays):
        holds = "one free decay" if len(decays) == 1 else f"{len(decays)} free decays"
        raise InputError("--decay", f"{chosen}, and the record holds {holds}", "give a smaller number")
    return [decays[chosen - 1]]


def refuse_twice(sources: Sequence[str]) -> None:
    """Refuse a record that is given twice.

    Raises
    ------
    InputError
        Naming it.
    """
    for source in sources:
        if sources.count(source) > 1:
            raise InputError(source, "is given twice", "give each record once")


def load_records(
    sources: Sequence[str], arguments: argparse.Namespace
) -> tuple[list[xr.DataArray], Oscillator]:
    """Read several records of one system.

    Parameters
    ----------
    sources : sequence of str
        As for :func:`load_decays`.
    arguments : argparse.Namespace
        Options of :func:`~friction_bayes.cli.options.add_system` and :func:`add_record`.

    Returns
    -------
    records : list of xarray.DataArray
    system : Oscillator

    Raises
    ------
    InputError
        If a record is given twice, or two are of different systems; naming all that cannot be read.
    """
    refuse_twice(sources)
    loaded = of_each(lambda source: load_decays(source, arguments), sources)
    records, systems = zip(*loaded, strict=True)
    for source, system in zip(sources, systems, strict=True):
        if system != systems[0]:
            raise InputError(
                source, f"is of another system than {sources[0]}", "give records of one system together"
            )
    return [decay for decays in records for decay in decays], systems[0]


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


def what_was_read_of_each(records: Sequence[xr.DataArray]) -> list[str]:
    """Say in a line of each what was understood of it, with its name where there are several."""
    from friction_bayes.records.description import what_was_read

    if len(records) == 1:
        return [what_was_read(records[0])]
    return [f"{record.attrs['name']}: {what_was_read(record)}" for record in records]
