"""The table of ordinary records: one line a row and estimator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.method_tables import share_error, with_error

__all__ = ["lines_of", "short"]

_SAME_GAIN = 1e-5
"""Relative difference below which a gain changes no interval."""


def lines_of(row: str, records: xr.Dataset, estimators: Sequence[str]) -> list[Mapping[str, str]]:
    """Return the lines of one row; an estimator without a result on any of its records has none.

    Parameters
    ----------
    row : str
        What it is called.
    records : xarray.Dataset
        Over ``replicate`` and ``estimator``; what :data:`experiments.ordinary.judged.VERDICT` names.
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
    ratio = _kept(own["ratio"])
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
        "covers signal's, %": "" if _as_moved(records) else _percent(own["covered_in_signal"]),
        "a whole interval off, %": _percent(own["off"]),
        "friction / truth (5 .. 95 %)": quantiles,
        "width, %": _middle(100.0 * own["width"]),
        "width / no force's": _beside_no_force(records) if label == "default" else "",
        "P(force)": _middle(own["force"]) if label == "default" else "",
    }


def _beside_no_force(records: xr.Dataset) -> str:
    """Median of the width of the default over that without a random force."""
    return _middle(
        records["width"].sel(estimator="default") / records["width"].sel(estimator="no random force")
    )


def _as_moved(records: xr.Dataset) -> bool:
    """Whether all signals are as large as the motion itself."""
    return bool(np.all(np.abs(records["gain"] - 1.0) < _SAME_GAIN))


def _middle(values: xr.DataArray) -> str:
    kept = _kept(values)
    return short(float(np.median(kept))) if kept.size else "–"


def short(value: float) -> str:
    """Two significant digits, and at least all before the point."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"


def _percent(hits: xr.DataArray) -> str:
    share, error = share_error(hits)
    return with_error(100.0 * share, 100.0 * error)


def _kept(values: xr.DataArray) -> NDArray[np.float64]:
    numbers = np.asarray(values, dtype=np.float64).ravel()
    return numbers[np.isfinite(numbers)]
