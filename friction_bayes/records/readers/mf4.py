"""MF4 (ASAM MDF) files, read in a process of their own: a damaged one can crash the library."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.optional import optional_package
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_mf4"]

_SIGNATURES = (b"MDF ", b"UnFinMF ")
"""Of a file that is finished, and of one that was still being written."""


def read_mf4(path: Path) -> Table:
    """Read the numeric channels of an MDF file, each with its own time stamps.

    Parameters
    ----------
    path : Path
        The file.
    """
    optional_package("asammdf", path)
    with path.open("rb") as file:
        known = file.read(8).startswith(_SIGNATURES)
    if not known:
        raise InputError(
            str(path), "this is not an MDF file (it begins otherwise)", "give the suffix of its format"
        )
    command = [sys.executable, "-m", __name__, str(path)]
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, env=places, check=False)
    if done.returncode:
        said = done.stderr.decode(errors="replace").splitlines()
        why = said[-1] if done.returncode > 0 and said else "the library that reads it crashed"
        raise InputError(str(path), f"this is not an MDF file ({why})", "give the suffix of its format")
    with np.load(BytesIO(done.stdout)) as arrays:
        channels = json.loads(str(arrays["channels"]))
        return Table(
            {
                name: Column(
                    partial(np.asarray, arrays[f"samples{k}"]),
                    unit=unit or None,
                    clock=partial(np.asarray, arrays[f"times{k}"]),
                )
                for k, (name, unit) in enumerate(channels)
            }
        )


def _write_channels(path: str) -> None:
    """Write the channels of a file to standard output, as ``numpy.savez`` does."""
    import asammdf

    with asammdf.MDF(path) as file:
        signals = [signal for signal in file.iter_channels() if _is_vector(signal.samples)]
    arrays = {f"samples{k}": signal.samples for k, signal in enumerate(signals)}
    arrays |= {f"times{k}": signal.timestamps for k, signal in enumerate(signals)}
    channels = json.dumps([(signal.name, signal.unit) for signal in signals])
    content = BytesIO()
    np.savez(content, channels=np.array(channels), **arrays)
    sys.stdout.buffer.write(content.getvalue())


def _is_vector(samples: NDArray[Any]) -> bool:
    return samples.ndim == 1 and samples.dtype.kind in "fiu"


if __name__ == "__main__":
    # what is left half open then is no reason
    sys.unraisablehook = lambda _: None
    try:
        _write_channels(sys.argv[1])
    # what a damaged file makes the library trip over
    except Exception as error:
        sys.exit(str(error) or type(error).__name__)
