"""WAV files of a data recorder."""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path

import numpy as np

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.table import Column, Table

__all__ = ["read_wav"]


def read_wav(path: Path) -> Table:
    """Read the channels "0", "1", ... of a WAV file; integer samples are ``counts``.

    Parameters
    ----------
    path : Path
        The file. It says neither quantity nor unit: both must be given.
    """
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            # chunks other than the samples, such as a recorder's notes, are passed over
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, samples = wavfile.read(path)
    except Exception as error:  # what a damaged file makes the library trip over
        raise InputError(
            str(path), f"this is not a WAV file ({error})", "give the suffix of its format"
        ) from None
    if rate == 0:
        raise InputError(
            str(path), "says that it has 0 samples a second", "the file is damaged: export it again"
        )
    unit = None if samples.dtype.kind == "f" else "counts"
    clock = partial(np.linspace, 0.0, (len(samples) - 1) / rate, len(samples))
    channels = samples.reshape(len(samples), -1).T
    return Table(
        {str(k): Column(partial(np.asarray, v), unit=unit, clock=clock) for k, v in enumerate(channels)}
    )
