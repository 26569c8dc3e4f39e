"""The table of ordinary records: one line a row and estimator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.method_tables import share_error, with_error

__all__ = ["lines_of"]


def lines_of(row: str, records: xr.Dataset, estimators: Sequence[str]) -> list[Mapping[str, str]]:
    """Return the lines of one row; an estimator that says nothing of any of its records has none.

    Parameters
    ----------
    row : str
        What it is called.
    records : xarray.Dataset
        Over ``replicate`` and ``estimator``, with :data:`experiments.ordinary.judged.VERDICT` as variables.
    estimators : sequence of str
        Which, in this order.
    """
    return [
        _line(row, label, records)
        for label in estimators
        if label != "witness" or float(records["refused"].sel(estimator=label).min()) == 0.0
    ]


def _line(row: str, label: str, records: xr.Dataset) -> Mapping[str, str]:
    own = records.sel(estimator=label)
    ratio, width = _kept(own["ratio"]), _kept(own["width"])
    quantiles = "–"
    if ratio.size:
        middle, low, high = np.quantile(ratio, [0.5, 0.05, 0.95])
        quantiles = f"{middle:.3f} ({low:.3f} .. {high:.3f})"
    return {
        "record": row,
        "estimate": label,
        "n": f"{own['refused'].size}",
        "refused": f"{int(own['refused'].sum())}",
        "warned": f"{int(own['warned'].sum())}",
        "covers, %": _percent(own["covered"]),
        "a whole interval off, %": _percent(own["off"]),
        "friction / truth (5 .. 95 %)": quantiles,
        "width, %": f"{100.0 * np.median(width):.2g}" if width.size else "–",
        "width / white": _beside_white(records) if label == "default" else "",
        "P(force)": f"{float(np.median(_kept(own['force']))):.2f}"
        if label == "default" and width.size
        else "",
    }


def _beside_white(records: xr.Dataset) -> str:
    """Median of the width of the default over that of white noise alone."""
    over = records["width"].sel(estimator="default") / records["width"].sel(estimator="white noise alone")
    kept = _kept(over)
    return f"{np.median(kept):.2g}" if kept.size else "–"


def _percent(hits: xr.DataArray) -> str:
    share, error = share_error(hits)
    return with_error(100.0 * share, 100.0 * error)


def _kept(values: xr.DataArray) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=np.float64).ravel()
    return numbers[np.isfinite(numbers)]
