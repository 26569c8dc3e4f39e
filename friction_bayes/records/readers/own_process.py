"""Reading in a process of its own, for libraries that a damaged file can crash or lead round without end."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError

__all__ = ["arrays_read_by", "write_arrays_of"]

_LONGEST = 30.0
"""Seconds that reading may take, in addition to those for the size of the file."""
_BYTES_A_SECOND = 2e6

Arrays = Mapping[str, NDArray[Any]]


def arrays_read_by(module: str, path: Path, format_name: str) -> dict[str, NDArray[Any]]:
    """Arrays that a module, run as a program with a path, writes of that file.

    Parameters
    ----------
    module : str
        It calls :func:`write_arrays_of` when run.
    path : Path
        The file.
    format_name : str
        What the file is said not to be, with its article, where that fails.

    Raises
    ------
    InputError
        If it ends otherwise than well.
    """
    command = [sys.executable, "-m", module, str(path)]
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    limit = _LONGEST + path.stat().st_size / _BYTES_A_SECOND
    try:
        done = subprocess.run(command, capture_output=True, env=places, check=False, timeout=limit)
    except subprocess.TimeoutExpired as error:
        raise InputError(
            str(path),
            f"the library that reads it has come to no end in {limit:.0f} s",
            "the file is damaged: export it again",
        ) from error
    if done.returncode:
        said = done.stderr.decode(errors="replace").splitlines()
        why = said[-1] if done.returncode > 0 and said else "the library that reads it crashed"
        raise InputError(str(path), f"this is not {format_name} ({why})", "give the suffix of its format")
    with np.load(BytesIO(done.stdout)) as arrays:
        return dict(arrays)


def write_arrays_of(read: Callable[[str], Arrays]) -> None:
    """Be that program: write the arrays of the file named to standard output, as ``numpy.savez`` does."""
    # what is left half open then is no reason
    sys.unraisablehook = lambda _: None
    try:
        content = BytesIO()
        np.savez(content, allow_pickle=False, **read(sys.argv[1]))
    # what a damaged file makes the library trip over
    except Exception as error:
        sys.exit(str(error) or type(error).__name__)
    sys.stdout.buffer.write(content.getvalue())
