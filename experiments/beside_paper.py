"""Rows of the closing tables: ours over the noise seeds beside the paper's one number, and emcee's word."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from experiments.tables import Row
from friction_bayes.core.arrays import Array

__all__ = [
    "band",
    "checked_records",
    "compared",
    "detail_rows",
    "diagnostics",
    "sampler_word",
    "verdict_rows",
]


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


def checked_records(dataset: xr.Dataset) -> xr.Dataset:
    """Return of one level and one method, over ``replicate``, the records that went through emcee."""
    return dataset.isel(replicate=np.flatnonzero(np.isfinite(dataset["rhat"].values)))


def diagnostics(one: xr.Dataset) -> str:
    """Return what emcee's draws of one record are worth."""
    return f"R-hat {float(one['rhat']):.4f}, ESS {float(one['ess_bulk']):.0f}"


def sampler_word(dataset: xr.Dataset, unit: str = "N") -> str:
    """Return emcee's mean beside the closed form's on the first checked record, and the worst diagnostics.

    Parameters
    ----------
    dataset : xarray.Dataset
        One level and one method, over ``replicate``.
    unit : str
        What the method's friction is in.
    """
    mine = checked_records(dataset)
    if mine.sizes["replicate"] == 0:
        return ""
    first = mine.isel(replicate=0)
    return (
        f"{float(first['reference_mean']):.5g} {unit} for {float(first['friction']):.5g} {unit}; "
        f"R-hat {float(mine['rhat'].max()):.4f}, "
        f"ESS {_least(mine['ess_bulk']):.0f}/{_least(mine['ess_tail']):.0f}, {_verdict(mine)}"
    )


def _least(values: xr.DataArray) -> float:
    return float(values.min())


def _verdict(checked: xr.Dataset) -> str:
    n = checked.sizes["replicate"]
    agreeing, converged = int(checked["agrees"].sum()), int(checked["converged"].sum())
    judged = int(np.isfinite(checked["agrees"]).sum())
    word = {0: "disagrees", judged: "agrees"}.get(agreeing, f"agrees in {agreeing} of {judged}")
    if judged < n:
        word = f"{word}, judged in {judged} of {n}" if judged else "not judged"
    return word if converged == n else f"{word}, converged in {converged} of {n}"


def verdict_rows(dataset: xr.Dataset) -> list[Row]:
    """Return how many of the closed forms that were checked agree with emcee, by method.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :func:`experiments.closed_forms.gather`.
    """
    rows = []
    for method in dataset["method"].values.tolist():
        mine = dataset.sel({"method": method})
        n = int(np.isfinite(mine["rhat"]).sum())
        if n:
            converged, ratio = int(mine["converged"].sum()), float(mine["time_ratio"].median())
            rows.append(
                Row(
                    f"agrees with emcee: {method}",
                    f"{int(mine['agrees'].sum())} of {n}",
                    remark=f"{converged} converged; false alarms 1 % each; "
                    f"emcee takes {ratio:.0f} times as long",
                    sampler=f"R-hat at most {float(mine['rhat'].max()):.4f}, "
                    f"ESS at least {_least(mine['ess_bulk']):.0f}/{_least(mine['ess_tail']):.0f}",
                )
            )
    return rows


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
            lines.append(named | {"method": method} | _figures(one) | _against_sampler(one))
    told = [heading for heading in lines[0] if any(line[heading] for line in lines)]
    return [{heading: line[heading] for heading in told} for line in lines]


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


def _against_sampler(one: xr.Dataset) -> dict[str, str]:
    headings = (
        "emcee mean - ours, in sd",
        "emcee 90 % width / ours",
        "R-hat",
        "ESS bulk/tail",
        "verdict",
        "time ratio",
    )
    mine = checked_records(one)
    if mine.sizes["replicate"] == 0:
        return dict.fromkeys(headings, "")
    shift = (mine["reference_mean"] - mine["friction"]) / mine["sd"]
    # not the standard deviation: few amplitudes leave Student's t with little more than two degrees of
    # freedom, whose standard deviation no number of draws tells
    width = mine["reference_high"] - mine["reference_low"]
    texts = (
        f"{float(shift.mean()):+.3f}",
        f"{float((width / (mine['high'] - mine['low'])).mean()):.3f}",
        f"{float(mine['rhat'].max()):.4f}",
        f"{_least(mine['ess_bulk']):.0f}/{_least(mine['ess_tail']):.0f}",
        _verdict(mine),
        f"{float(mine['time_ratio'].median()):.0f}",
    )
    return dict(zip(headings, texts, strict=True))
