"""Rows of the closing tables: ours over the noise seeds, and the paper's one number."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from experiments.against_emcee import three_columns
from experiments.tables import Row
from friction_bayes.core.arrays import Array

__all__ = ["band", "compared", "detail_rows"]


def _kept(values: xr.DataArray) -> Array:
    numbers = np.asarray(values, dtype=np.float64).ravel()
    return numbers[np.isfinite(numbers)]


def band(values: xr.DataArray, *, digits: int = 3, factor: float = 1.0) -> str:
    """Return median and 90 % band over the seeds as text."""
    numbers = factor * _kept(values)
    if numbers.size == 0:
        return "none"
    low, middle, high = np.quantile(numbers, [0.05, 0.5, 0.95])
    return f"{middle:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def compared(
    what: str,
    values: xr.DataArray,
    paper: float,
    *,
    unit: str = "",
    digits: int = 3,
    factor: float = 1.0,
    sampler: str = "",
) -> Row:
    """Return a row that says whether the paper's number lies in the 90 % band of ours over the seeds.

    Parameters
    ----------
    what : str
        What is compared.
    values : xarray.DataArray
        One number a seed.
    paper : float
        The paper's, in ``unit``.
    unit : str
        Shown with both.
    digits : int
        Significant digits.
    factor : float
        From the values to ``unit``.
    sampler : str
        What emcee found on the records that were checked.
    """
    numbers = factor * _kept(values)
    remark = "all records refused"
    if numbers.size:
        low, high = np.quantile(numbers, [0.05, 0.95])
        place = "in" if low <= paper <= high else ("above" if paper > high else "below")
        remark = f"paper {place} our 90 % band"
    return Row(
        what=what,
        ours=f"{band(values, digits=digits, factor=factor)} {unit}".strip(),
        paper=f"{paper:g} {unit}".strip(),
        remark=remark,
        sampler=sampler,
    )


def detail_rows(dataset: xr.Dataset, levels: Sequence[str]) -> list[Mapping[str, str]]:
    """Return one line a level and method: error, coverage, width, precision, and closed form against emcee.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`experiments.closed_forms.gather`.
    levels : sequence of str
        Its swept dimensions.
    """
    lines = []
    stacked = dataset.stack(level=list(levels), create_index=False)
    for i in range(stacked.sizes["level"]):
        for method in dataset["method"].values.tolist():
            one = stacked.isel(level=i).sel({"method": method})
            named = {name: _label(one[name].item()) for name in levels}
            lines.append(named | {"method": method} | _figures(one) | three_columns(one))
    filled = [heading for heading in lines[0] if any(line[heading] for line in lines)]
    return [{heading: line[heading] for heading in filled} for line in lines]


def _label(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _figures(one: xr.Dataset) -> dict[str, str]:
    error, refused = _kept(one["error"]), int(one["refused"].sum())
    if error.size == 0:
        return dict.fromkeys(("error %", "RMS %", "90 % interval covers", "its width %", "precision"), "") | {
            "refused": f"{refused}"
        }
    return {
        "error %": band(one["error"], factor=100.0),
        "RMS %": f"{100.0 * math.sqrt(float(np.mean(error**2))):.3g}",
        "90 % interval covers": f"{int(one['covers'].sum())} of {error.size}",
        "its width %": f"{100.0 * float(one['width'].median()):.3g}",
        "precision": band(one["precision"]) if _kept(one["precision"]).size else "",
        "refused": f"{refused}" if refused else "",
    }
