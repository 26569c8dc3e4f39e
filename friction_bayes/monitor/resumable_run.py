"""Long runs that can be interrupted: finished parts are kept next to the output folder until all are."""

from __future__ import annotations

import glob
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import dask
import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.files import cannot_be_written, nearest_existing, settings_key, versions, write_whole

__all__ = ["Columns", "compute_parts", "parts_folder", "run_key"]

_NOT_OF_THE_RESULT = {"out", "force", "resume", "workers", "scheduler"}
"""Options that change no number."""

Columns = dict[str, NDArray[Any]]
"""Arrays by name."""


def run_key(command: str, options: Mapping[str, Any], inputs: Mapping[str, str]) -> str:
    """Return a digest of all that the numbers of a run depend on.

    Parameters
    ----------
    command : str
    options : mapping
        As parsed; those that say where and how fast are left out.
    inputs : mapping of str to str
        Digests of the records by name.
    """
    relevant = {name: value for name, value in options.items() if name not in _NOT_OF_THE_RESULT}
    settings = [command, relevant, dict(inputs), versions()]
    return settings_key(settings)


@contextmanager
def parts_folder(
    target: str | Path, key: str, *, resume: bool, note: Callable[[str], None]
) -> Iterator[Path]:
    """Yield the folder next to ``target`` for the parts of a run; it goes when the run is whole.

    Parameters
    ----------
    target : path
        The output folder of the run.
    key : str
        Of :func:`run_key`: parts of a run with another key are never used, and removed.
    resume : bool
        Keep the parts of an interrupted run with the same key.
    note : callable
        Called with a sentence where parts were kept that cannot be used.

    Raises
    ------
    InputError
        If the folder cannot be made.
    KeyboardInterrupt
        Of the run, with what was kept as its message.
    """
    out = Path(target).absolute()
    beside, name = nearest_existing(out.parent), f".{out.name}.parts-"
    folder = beside / f"{name}{key}"
    earlier = list(beside.glob(f"{glob.escape(name)}*"))
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
        if not any(folder.glob("*.npz")):
            shutil.rmtree(folder, ignore_errors=True)
        elif isinstance(error, KeyboardInterrupt):
            raise KeyboardInterrupt("finished parts are kept, and --resume continues from them") from None
        raise
    shutil.rmtree(folder, ignore_errors=True)


def compute_parts(tasks: Sequence[Any], folder: Path, *, note: Callable[[str], None]) -> list[Columns]:
    """Compute with Dask what is not there yet, keeping every part as soon as it is done.

    Parameters
    ----------
    tasks : sequence of dask.delayed.Delayed
        Each gives named arrays.
    folder : Path
        Of :func:`parts_folder`; workers of a cluster see it as they see the input.
    note : callable
        Called with a sentence where parts are read back.

    Returns
    -------
    list of dict of str to ndarray
        One a task, the same bits whether computed now or read back.
    """
    files = [folder / f"{k}.npz" for k in range(len(tasks))]
    missing = [k for k, file in enumerate(files) if not file.exists()]
    if len(missing) < len(tasks):
        note(f"resuming: {len(tasks) - len(missing)} of {len(tasks)} parts are done")
    dask.compute(*(dask.delayed(_keep)(tasks[k], files[k]) for k in missing))
    return [_read(file) for file in files]


def _keep(columns: Columns, file: Path) -> None:
    def write(path: Path) -> None:
        with path.open("wb") as stream:
            np.savez(stream, **columns)  # type: ignore[arg-type]

    write_whole(file, write)


def _read(file: Path) -> Columns:
    with np.load(file, allow_pickle=False) as kept:
        return dict(kept)
