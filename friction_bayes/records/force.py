"""A friction force that was measured along with a record, brought to the record's samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from friction_bayes.core.arrays import Array
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.records.readers import read_table
from friction_bayes.records.readers.table import is_time, times_of

__all__ = ["read_force"]

_COLUMNS = {False: "force_N", True: "torque_N_m"}


def read_force(path: str | Path, record: xr.DataArray) -> Array:
    """Read a measured friction force.

    Parameters
    ----------
    path : str or Path
        A file that :func:`friction_bayes.records.readers.read_table` reads, with ``time_s`` and ``force_N``
        (``torque_N_m`` with an angle); without ``time_s`` it has a row for each sample of the record.
    record : xarray.DataArray
        The record it belongs to.

    Returns
    -------
    ndarray, shape (n,)
        Force at the samples of the record [N or N m], linear between its own.

    Raises
    ------
    InputError
        If the file cannot be read, has no such column, does not cover the record, or has times of the day
        from another stamp on.
    """
    place = str(path)
    table = read_table(path)
    wanted = _COLUMNS[QUANTITIES[record.attrs["quantity"]].angular]
    names = {name.lower(): name for name in table.columns}
    if wanted.lower() not in names:
        raise InputError(place, f"no column {wanted} among {', '.join(table.columns)}", f"name it {wanted}")
    column = table.columns[names[wanted.lower()]]
    force = np.asarray(column.read(), dtype=np.float64)
    if not np.isfinite(force).all():
        row = int(np.flatnonzero(~np.isfinite(force))[0])
        where = row if column.rows is None else int(column.rows[row])
        raise InputError(f"{place} row {where}", f"{force[row]} is not finite", "leave such rows out")
    clock = next((name for name, other in table.columns.items() if is_time(name, other)), None)
    if clock is None:
        if force.size != record.size:
            raise InputError(
                place,
                f"has {force.size} rows, the record {record.size}",
                "add a column time_s, or match them",
            )
        return force
    since = table.columns[clock].since
    # both are seconds from the first stamp of their file
    if since is not None and f"since {since}]" not in record.attrs.get("read", ""):
        raise InputError(
            place,
            f"its times begin at {since}, those of the record do not",
            "let both begin with one stamp, or leave out its times and give a row for each sample",
        )
    time = np.asarray(times_of(column, table, place, clock), dtype=np.float64)
    if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
        raise InputError(place, "its times do not rise", "sort its rows by time")
    moments = np.asarray(record["time"].values, dtype=np.float64)
    half = 0.5 * float(moments[1] - moments[0])
    if time[0] > moments[0] + half or time[-1] < moments[-1] - half:
        raise InputError(
            place,
            f"covers {time[0]:g} to {time[-1]:g} s of a record from {moments[0]:g} to {moments[-1]:g} s",
            "give the force over the whole record",
        )
    return np.interp(moments, time, force)
