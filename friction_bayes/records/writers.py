"""Records to files that :func:`friction_bayes.records.readers.read_record` reads back as they were."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from friction_bayes.core.errors import InputError
from friction_bayes.core.files import write_whole
from friction_bayes.core.quantities import UNCALIBRATED_UNITS
from friction_bayes.core.strict_json import plain
from friction_bayes.records.record import record_quantity, validate_record

__all__ = ["write_record"]


def write_record(record: xr.DataArray, path: str | Path) -> Path:
    """Write a record; the file appears whole or not at all.

    Parameters
    ----------
    record : xarray.DataArray
        A valid record.
    path : str or Path
        Ends in ``.csv`` (every digit, attributes as comments) or ``.nc``. An existing file is replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the suffix is another, the record is not valid, or the file cannot be written.
    """
    target = Path(path)
    writers: dict[str, Callable[[xr.DataArray, Path], None]] = {".csv": _write_csv, ".nc": _write_netcdf}
    if target.suffix.lower() not in writers:
        raise InputError(
            str(path), f"cannot write a record as {target.suffix!r}", f"give one of {', '.join(writers)}"
        )
    validate_record(record)
    write = writers[target.suffix.lower()]
    write_whole(target, lambda aside: write(record, aside))
    return target


def _write_csv(record: xr.DataArray, path: Path) -> None:
    kind, unit = record_quantity(record), record.attrs["units"]
    column = f"{kind.name}_{unit}" if unit in UNCALIBRATED_UNITS else kind.column
    lines = ["# synthetic record, not measured"] if record.attrs.get("synthetic") else []
    lines += [
        f"# {key}: {value}" for key, value in _scalars(record).items() if key not in {"synthetic", "units"}
    ]
    lines.append(f"time_s,{column}")
    # repr is the shortest text that reads back as the same double
    time, values = record["time"].values.tolist(), np.asarray(record.values, dtype=float).tolist()
    lines += [f"{t!r},{x!r}" for t, x in zip(time, values, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_netcdf(record: xr.DataArray, path: Path) -> None:
    record.copy(deep=False).assign_attrs(_scalars(record)).to_netcdf(path, engine="h5netcdf")


def _scalars(record: xr.DataArray) -> dict[str, Any]:
    """Return the attributes as text and numbers, the rest as JSON; NetCDF has no booleans."""
    attrs = {key: int(v) if isinstance(v, bool) else v for key, v in record.attrs.items()}
    return {
        key: v if isinstance(v, str | int | float) else json.dumps(plain(v), default=str)
        for key, v in attrs.items()
    }
