"""Measured free decays with their systems, fetched when asked for and checked against their digests."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import xarray as xr

from friction_bayes.core.errors import InputError, unknown_name
from friction_bayes.core.files import sha256_of
from friction_bayes.core.system import Oscillator, Pendulum
from friction_bayes.records.readers import read_table
from friction_bayes.records.readers.table import record_from_table

__all__ = [
    "DATASETS",
    "DataFile",
    "DataSet",
    "Part",
    "dataset_record",
    "fetch_dataset",
    "list_datasets",
    "load_registry",
]

LOCAL_FOLDER = "FRICTION_BAYES_DATA"
"""Environment variable naming a folder that holds ``NAME/FILE`` for data sets already there."""


@dataclass(frozen=True, kw_only=True)
class DataFile:
    """One upstream file: where it lies in the repository, and the SHA-256 digest it must have."""

    name: str
    path: str
    sha256: str
    url: str


@dataclass(frozen=True, kw_only=True)
class Part:
    """One record of a data set.

    Attributes
    ----------
    name, file : str
        Its name, and the file it lies in.
    unit : str
        Unit in the file.
    signal_column, time_column : str
        Columns as :func:`friction_bayes.read_record` takes them; no time column with a sampling rate.
    sampling_rate : float, optional
        Samples per second, where the file has no time.
    run : int, optional
        Number of the run, in a file of several.
    skip_rows : int
        Lines above the data of a text file.
    zero : float
        Sensor reading at the nominal rest position, subtracted [SI].
    start : float, optional
        Time before which the motion is not free [s]; cut off.
    mass : float, optional
        Moving mass, where it is not that of the data set's system [kg].
    note : str
        What a user should know of this record.
    """

    name: str
    file: str
    unit: str
    signal_column: str
    time_column: str | None = None
    sampling_rate: float | None = None
    run: int | None = None
    skip_rows: int = 0
    zero: float = 0.0
    start: float | None = None
    mass: float | None = None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """A registered data set.

    Attributes
    ----------
    name, title, citation, licence : str
        What it is, and whose.
    repository, commit : str
        Upstream repository on GitHub and the commit its files are pinned to.
    quantity : str
        What was measured.
    system : Oscillator
        The system declared with it.
    system_source : str
        Where inertia and stiffness come from.
    system_assumed : bool
        Whether they are partly our assumption rather than stated by the source.
    authors_assume : str
        The friction model its authors use.
    note : str
        What a user should know.
    default : str
        Part taken when none is named.
    files : mapping of str to DataFile
    parts : mapping of str to Part
    """

    name: str
    title: str
    citation: str
    licence: str
    repository: str
    commit: str
    quantity: str
    system: Oscillator
    system_source: str
    system_assumed: bool
    authors_assume: str
    note: str
    default: str
    files: Mapping[str, DataFile]
    parts: Mapping[str, Part]


def load_registry(path: str | Path) -> dict[str, DataSet]:
    """Read a registry of data sets.

    Parameters
    ----------
    path : str or Path
        A TOML file laid out like this package's ``dataset_registry.toml``.

    Returns
    -------
    dict of str to DataSet
        In the order of the file.
    """
    entries = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    return {name: _data_set(name, entry) for name, entry in entries.items()}


def _data_set(name: str, entry: dict[str, Any]) -> DataSet:
    system = dict(entry.pop("system"))
    source, assumed = system.pop("source"), system.pop("assumed")
    kind = Pendulum if system.pop("pendulum") else Oscillator
    root = f"https://raw.githubusercontent.com/{entry['repository']}/{entry['commit']}"
    files, parts = entry.pop("files"), entry.pop("parts")
    return DataSet(
        name=name,
        system=kind(**system),
        system_source=source,
        system_assumed=assumed,
        files={key: DataFile(name=key, url=f"{root}/{file['path']}", **file) for key, file in files.items()},
        parts={key: Part(name=key, **part) for key, part in parts.items()},
        **entry,
    )


DATASETS: dict[str, DataSet] = load_registry(Path(__file__).with_name("dataset_registry.toml"))
"""The registered data sets by name."""


def list_datasets() -> tuple[DataSet, ...]:
    """Return the known data sets, for a table of them."""
    return tuple(DATASETS.values())


def fetch_dataset(name: str) -> tuple[Path, ...]:
    """Make sure that every file of a data set is on this machine, and return where.

    Raises
    ------
    InputError
        As :func:`dataset_record`.
    """
    data_set, _ = _look_up(name)
    return tuple(_fetch(data_set, file) for file in data_set.files.values())


def dataset_record(name: str) -> tuple[xr.DataArray, Oscillator]:
    """Return a measured record and the system declared with it.

    Files are looked for in the folder named by the environment variable ``FRICTION_BAYES_DATA``, then in the
    download cache, and else downloaded. Their digests are checked each time.

    Parameters
    ----------
    name : str
        ``NAME`` or ``NAME/PART``, such as "map-single-pendulum/validation-1".

    Returns
    -------
    record : xarray.DataArray
        Validated; attributes ``note`` and ``system_source`` say what should be known of it.
    system : Oscillator

    Raises
    ------
    InputError
        If name or part is unknown, a file can be neither found nor downloaded, or its digest is wrong.
    """
    data_set, part = _look_up(name)
    path = _fetch(data_set, data_set.files[part.file])
    record = record_from_table(
        read_table(path, skip_rows=part.skip_rows),
        place=str(path),
        name=f"{data_set.name}/{part.name}",
        quantity=data_set.quantity,
        unit=part.unit,
        time_column=part.time_column,
        signal_column=part.signal_column,
        sampling_rate=part.sampling_rate,
        run=part.run,
        start=part.start,
    )
    record = record.copy(data=record.values - part.zero)
    record.attrs["system_source"] = ("assumed: " if data_set.system_assumed else "") + data_set.system_source
    record.attrs["note"] = " ".join(filter(None, (data_set.note, part.note)))
    if part.mass is not None:
        return record, replace(data_set.system, mass=part.mass)
    return record, data_set.system


def _look_up(name: str) -> tuple[DataSet, Part]:
    set_name, _, part_name = name.partition("/")
    if set_name not in DATASETS:
        raise unknown_name(f"dataset:{name}", "data set", set_name, DATASETS)
    data_set = DATASETS[set_name]
    part_name = part_name or data_set.default
    if part_name not in data_set.parts:
        raise unknown_name(f"dataset:{name}", "part", part_name, data_set.parts)
    return data_set, data_set.parts[part_name]


def _fetch(data_set: DataSet, file: DataFile) -> Path:
    """Return the path of a file on this machine, its digest checked."""
    folder = os.environ.get(LOCAL_FOLDER)
    if folder:
        if not Path(folder).is_dir():
            raise InputError(
                LOCAL_FOLDER, f"{folder} is not a folder", "name the folder of data sets, or unset it"
            )
        local = Path(folder) / data_set.name / file.name
        if local.is_file():
            digest = sha256_of(local)
            if digest != file.sha256:
                raise InputError(
                    str(local),
                    f"sha256 is {digest}, not {file.sha256}",
                    f"replace it by the file of {file.url}, or remove it to have that downloaded",
                )
            return local
    return _download(data_set, file)


def _download(data_set: DataSet, file: DataFile) -> Path:
    import pooch

    pooch.get_logger().setLevel("WARNING")
    cache = Path(pooch.os_cache("friction-bayes")) / data_set.name
    try:
        found = pooch.retrieve(file.url, known_hash=f"sha256:{file.sha256}", path=cache, fname=file.name)
    except ValueError as error:
        raise InputError(
            file.url, f"the download is not the pinned file ({error})", "try again, or fetch the file by hand"
        ) from None
    except OSError as error:
        raise InputError(
            f"dataset:{data_set.name}",
            f"cannot download {file.url} ({type(error).__name__})",
            f"name by {LOCAL_FOLDER} a folder that holds {data_set.name}/{file.name}",
        ) from None
    return Path(found)
