"""Records from files: one small reader a family of formats, chosen by suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.records.readers.archive import read_archive
from friction_bayes.records.readers.excel import read_excel
from friction_bayes.records.readers.hdf5 import read_hdf5
from friction_bayes.records.readers.mat import read_mat
from friction_bayes.records.readers.mf4 import read_mf4
from friction_bayes.records.readers.netcdf import read_netcdf, read_zarr
from friction_bayes.records.readers.table import Column, Table, record_from_table
from friction_bayes.records.readers.tdms import read_tdms
from friction_bayes.records.readers.text import TEXT_SUFFIXES, read_text
from friction_bayes.records.readers.tracker import read_tracker
from friction_bayes.records.readers.uff import read_uff
from friction_bayes.records.readers.wav import read_wav

__all__ = ["READERS", "Column", "Table", "read_record", "read_table"]

READERS: dict[str, Callable[[Path], Table]] = {
    **dict.fromkeys(TEXT_SUFFIXES, read_text),
    ".xlsx": read_excel,
    ".xls": read_excel,
    ".ods": read_excel,
    ".zip": read_archive,
    ".mat": read_mat,
    ".nc": read_netcdf,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".zarr": read_zarr,
    ".wav": read_wav,
    ".tdms": read_tdms,
    ".trk": read_tracker,
    ".uff": read_uff,
    ".unv": read_uff,
    ".mf4": read_mf4,
}
"""Suffix to reader. A new format is one function that returns a :class:`Table`, and one entry here."""


def read_table(path: str | Path, *, skip_rows: int = 0) -> Table:
    """Read the channels of a file.

    Parameters
    ----------
    path : str or Path
        A file with a suffix of ``READERS``; for ``.zarr`` a folder.
    skip_rows : int
        Lines of a text file to pass over at the top.

    Raises
    ------
    InputError
        If it is not there, empty, of unknown format, or not what its suffix says.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if not file.exists():
        raise InputError(str(path), "there is no such file", "give the path of a record")
    if file.is_dir() and suffix != ".zarr":
        raise InputError(
            str(path), "this is a folder", "give the path of one record file, or of a .zarr folder"
        )
    if suffix not in READERS:
        known = ", ".join(READERS)
        raise InputError(str(path), f"unknown suffix {file.suffix!r}", f"give a file of one of {known}")
    if suffix == ".zarr" and not file.is_dir():
        raise InputError(str(path), "this is a file", "give the folder that Zarr wrote")
    reader = READERS[suffix]
    if skip_rows and reader is not read_text:
        raise InputError("--skip-rows", f"does not apply to {suffix} files", "leave it out")
    try:
        if file.is_file() and file.stat().st_size == 0:
            raise InputError(str(path), "the file is empty", "give a file with rows of numbers")
        table = read_text(file, skip_rows=skip_rows) if skip_rows else reader(file)
    except PermissionError:
        raise InputError(str(path), "the file may not be read", "check its permissions") from None
    if not table.columns:
        raise InputError(str(path), "the file holds no vector of numbers", "give a file with a record")
    return table


def read_record(
    path: str | Path,
    *,
    quantity: str | None = None,
    unit: str | None = None,
    scale: float | None = None,
    time_column: str | int | None = None,
    signal_column: str | int | None = None,
    sampling_rate: float | None = None,
    run: int | None = None,
    skip_rows: int = 0,
    duplicates: str | None = None,
    start: float | None = None,
    end: float | None = None,
    name: str | None = None,
) -> xr.DataArray:
    """Read one record from a file.

    Column names such as ``time_s`` and ``displacement_mm``, or ``Time (s)`` and ``Angle (deg)``, carry
    quantity and unit; the options give what they do not. Times are kept as they are, uneven ones too.

    Parameters
    ----------
    path : str or Path
        A file with a suffix of ``READERS``; for ``.zarr`` a folder.
    quantity, unit : str, optional
        What the signal is and in which unit, where the file does not say it. Converted to SI.
    scale : float, optional
        Factor that brings the numbers of the file to ``unit``; where that is a sensitivity, such as ``mV/g``
        or ``counts/rad``, the sensitivity, by which they are divided.
    time_column, signal_column : str or int, optional
        Columns by name, or by position counted from zero.
    sampling_rate : float, optional
        Samples per second; takes the place of the time column.
    run : int, optional
        Number of the run, in a file of several side by side (columns named ``Angle (rad) Run #3``). Columns
        are then named and counted within the run.
    skip_rows : int
        Lines of a text file to pass over at the top, whatever they hold.
    duplicates : {"first", "mean"}, optional
        What to take of samples with one time stamp, as of a logger that writes faster than its clock ticks;
        doubled stamps are refused when left out.
    start, end : float, optional
        Part of the file that is taken [s].
    name : str, optional
        What messages and figures call the record; the file's name when left out.

    Returns
    -------
    xarray.DataArray
        The validated record, see :func:`friction_bayes.records.record.make_record`; its attribute ``read``
        says which columns it was taken from, in which unit.

    Raises
    ------
    InputError
        If the file cannot be read, the choice of columns is not clear, or the record cannot be used; names
        the file and, in text files, the row.
    """
    return record_from_table(
        read_table(path, skip_rows=skip_rows),
        place=str(path),
        name=name,
        quantity=quantity,
        unit=unit,
        scale=scale,
        time_column=time_column,
        signal_column=signal_column,
        sampling_rate=sampling_rate,
        run=run,
        duplicates=duplicates,
        start=start,
        end=end,
    )
