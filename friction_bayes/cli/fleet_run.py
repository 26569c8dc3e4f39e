"""A command on a fleet: its records in parts, on workers, each part kept until all are there."""

from __future__ import annotations

import argparse
import glob
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from friction_bayes.cli.console import note, progress_bar
from friction_bayes.cli.options import options_of
from friction_bayes.cli.records import OPTIONS_OF_A_RECORD
from friction_bayes.core.errors import InputError
from friction_bayes.core.files import (
    cannot_be_written,
    listing_digest,
    manifest,
    nearest_existing,
    settings_key,
    versions,
)
from friction_bayes.core.workers import for_each

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Fleet", "finished_parts", "fleet_manifest", "fleet_of", "is_finished", "rows_of"]

_LONG_RUN = ("resume", "workers", "scheduler")
_NOT_OF_THE_RESULT = {"out", "force", "json", "verbose", *_LONG_RUN}
"""Options that change no number."""

FleetPart = tuple[Any, Path]
"""Which records, as an index of the fleet, and the file in which they are kept."""


@dataclass(frozen=True)
class Fleet:
    """Where the records of a fleet are: what a worker needs to open it as the command did.

    Attributes
    ----------
    path : Path
    blocks : dict of str to int
        Records read at once, by dimension.
    digest : str
        Of the names, sizes and times of the files: to read them all takes as long as to estimate.
    """

    path: Path
    blocks: Mapping[str, int]
    digest: str

    def open(self) -> xr.DataArray:
        """Open the records, which stay on disk."""
        from friction_bayes.records.fleet import open_fleet

        records = open_fleet(self.path, self.blocks)
        if records is None:
            raise InputError(str(self.path), "has changed: it holds no fleet any more", "start anew")
        return records


def fleet_of(arguments: argparse.Namespace, *, without: Sequence[str] = ()) -> Fleet | None:
    """Return the fleet that the one record given is, None where records are given.

    Parameters
    ----------
    arguments : argparse.Namespace
        With ``records`` and the options of :func:`~friction_bayes.cli.options.add_long_run`.
    without : sequence of str
        Options of the command that a fleet does not have.

    Raises
    ------
    InputError
        If a fleet is not alone, or an option is given that is not for it, or for it only.
    """
    found = None
    for path in map(Path, arguments.records):
        if path.suffix.lower() == ".zarr" and path.is_dir():
            from friction_bayes.records.fleet import open_fleet

            if (records := open_fleet(path)) is not None:
                found = Fleet(path.absolute(), _blocks(records), listing_digest(path))
    for option in _LONG_RUN if found is None else (*OPTIONS_OF_A_RECORD, *without):
        given = getattr(arguments, option)
        if given is not None and given is not False:
            problem = "is for a fleet" if found is None else "does not apply to a fleet"
            raise InputError(f"--{option.replace('_', '-')}", problem, "leave it out")
    if found is None:
        return None
    if len(arguments.records) > 1:
        raise InputError("records", "a fleet among other records", "give a fleet alone")
    if arguments.out is None:
        raise InputError("--out", "is missing", "say where the results of the fleet go")
    if arguments.workers is not None and arguments.workers < 1:
        raise InputError("--workers", f"{arguments.workers} is not a number of processes", "give 1 or more")
    return found


def _blocks(records: xr.DataArray) -> dict[str, int]:
    return {str(name): chunks[0] for name, chunks in records.chunksizes.items() if name != "time"}


def rows_of(fleet: Fleet, records: xr.DataArray) -> list[slice]:
    """Cut a fleet along its first dimension into what is read at once."""
    first = str(records.dims[0])
    size = fleet.blocks[first]
    return [slice(i, i + size) for i in range(0, records.sizes[first], size)]


def fleet_manifest(command: str, arguments: argparse.Namespace, fleet: Fleet) -> dict[str, Any]:
    """Return the manifest of a run over a fleet."""
    made = manifest(command, options=options_of(arguments), seed=getattr(arguments, "seed", None))
    inputs = [{"record": arguments.records[0], "sha256_of_listing": fleet.digest}]
    return made | {"inputs": inputs, "settings": _settings(command, arguments, fleet)}


def is_finished(command: str, arguments: argparse.Namespace, fleet: Fleet) -> bool:
    """Whether ``--resume`` is given and the very result is there, which is then said."""
    if not arguments.resume or _settings_of(Path(arguments.out)) != _settings(command, arguments, fleet):
        return False
    for left in _parts_folders(arguments.out):
        shutil.rmtree(left, ignore_errors=True)
    note(f"{arguments.out} is finished already")
    return True


def _settings(command: str, arguments: argparse.Namespace, fleet: Fleet) -> str:
    """Digest of all that the numbers of a run depend on."""
    relevant = {name: each for name, each in options_of(arguments).items() if name not in _NOT_OF_THE_RESULT}
    return settings_key([command, relevant, fleet.blocks, fleet.digest, versions()])


def _settings_of(out: Path) -> Any:
    """The same of the result that is there, None where none is."""
    try:
        if out.suffix.lower() == ".zarr":
            attributes = json.loads((out / ".zattrs").read_text(encoding="utf-8"))
            return json.loads(attributes["manifest"])["settings"]
        return json.loads((out / "manifest.json").read_text(encoding="utf-8"))["settings"]
    except (OSError, ValueError, KeyError, TypeError):
        return None


@contextmanager
def finished_parts(
    command: str,
    arguments: argparse.Namespace,
    fleet: Fleet,
    which: Sequence[Any],
    work: Callable[[FleetPart], object],
    suffix: str,
) -> Iterator[list[Path]]:
    """Do what is not done yet; yield the files of all parts, which go when what is made of them is there.

    Parameters
    ----------
    command : str
    arguments : argparse.Namespace
        Its options.
    fleet : Fleet
    which : sequence
        Records of each part, as an index of the fleet.
    work : callable
        Called with these and a file, on a worker; the file appears whole.
    suffix : str
        Of the files.
    """
    key = _settings(command, arguments, fleet)
    with _parts_folder(arguments.out, key, resume=arguments.resume) as folder:
        files = [folder / f"{k}{suffix}" for k in range(len(which))]
        there = {path.name for path in folder.iterdir()}
        missing = [part for part in zip(which, files, strict=True) if part[1].name not in there]
        if len(missing) < len(files):
            note(f"resuming: {len(files) - len(missing)} of {len(files)} parts are done")
        with progress_bar() as bar:
            task = bar.add_task("fleet", total=len(missing))
            for_each(
                work,
                missing,
                scheduler=arguments.scheduler,
                workers=arguments.workers or os.cpu_count() or 1,
                done=lambda: bar.advance(task),
            )
        yield files


@contextmanager
def _parts_folder(target: str | Path, key: str, *, resume: bool) -> Iterator[Path]:
    """Yield the folder next to ``target`` for the parts of a run; it goes when the run is whole.

    Parts of a run with another key are never used, and removed; so are all that are not resumed.
    """
    earlier = _parts_folders(target)
    out = Path(target).absolute()
    folder = nearest_existing(out.parent) / f".{out.name}.parts-{key}"
    for other in earlier:
        if other != folder or not resume:
            shutil.rmtree(other, ignore_errors=True)
    if resume and earlier and folder not in earlier:
        note("the input, an option or a version has changed since the interrupted run: starting anew")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_be_written(f"--out {target}", error) from None
    try:
        yield folder
    except BaseException as error:
        if not any(folder.glob("[0-9]*")):
            shutil.rmtree(folder, ignore_errors=True)
        elif isinstance(error, KeyboardInterrupt):
            raise KeyboardInterrupt("finished parts are kept, and --resume continues from them") from None
        raise
    shutil.rmtree(folder, ignore_errors=True)


def _parts_folders(target: str | Path) -> list[Path]:
    """Folders with parts of a result that earlier runs have left."""
    out = Path(target).absolute()
    return list(nearest_existing(out.parent).glob(f".{glob.escape(out.name)}.parts-*"))
