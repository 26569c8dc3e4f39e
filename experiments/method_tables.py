"""Tables of the comparison of methods, every figure with its Monte Carlo error."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from experiments.against_emcee import word
from experiments.tables import Row
from friction_bayes.core.arrays import Array

__all__ = [
    "detail_lines",
    "percent_of",
    "share_error",
    "size_of_error",
    "summarised",
    "summary_rows",
    "with_error",
]

OURS, PAPER = "waveform", "normal-gamma, highest"
BASE = "effect: none"
"""The condition whose times are shown."""


def _kept(values: xr.DataArray) -> Array:
    numbers = np.asarray(values, dtype=np.float64).ravel()
    return numbers[np.isfinite(numbers)]


def size_of_error(error: xr.DataArray) -> tuple[float, float]:
    """Root mean square of an error over records, and the standard error of that (nan where there is none)."""
    squares = _kept(error) ** 2
    if squares.size == 0:
        return math.nan, math.nan
    root = math.sqrt(float(squares.mean()))
    if squares.size == 1 or root == 0.0:
        return root, math.nan
    return root, float(squares.std(ddof=1)) / math.sqrt(squares.size) / (2.0 * root)


def share_error(hits: xr.DataArray) -> tuple[float, float]:
    """Share of ones, and its standard error; that of one miss in twice as many where all or none hit."""
    found = _kept(hits)
    if found.size == 0:
        return math.nan, math.nan
    share = float(found.mean())
    inner = min(max(share, 0.5 / found.size), 1.0 - 0.5 / found.size)
    return share, math.sqrt(inner * (1.0 - inner) / found.size)


def with_error(value: float, error: float, digits: int = 2) -> str:
    """Write a value to the decimals that its error leaves it."""
    if not math.isfinite(value):
        return "–"
    if not math.isfinite(error) or error == 0.0:
        return f"{value:.{digits}g}"
    decimals = max(0, -math.floor(math.log10(error)) + (1 if error < 1.0 else 0) - 1)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}" if value < 1e4 else f"{value:.2g} ± {error:.1g}"


def percent_of(hits: xr.DataArray) -> str:
    """Write the share of ones in per cent, with its standard error."""
    share, error = share_error(hits)
    return f"{with_error(100.0 * share, 100.0 * error)} %"


SUMMARY: dict[str, tuple[str, str]] = {
    "rms_error": ("1", "root mean square of the error over records"),
    "rms_error_se": ("1", "its Monte Carlo standard error"),
    "bias": ("1", "mean of the error over records"),
    "coverage": ("1", "share of 90 % intervals that cover the true friction"),
    "coverage_se": ("1", "its Monte Carlo standard error"),
    "median_width": ("1", "median width of the 90 % interval over the true friction"),
    "median_elapsed": ("s", "median wall time"),
}


def summarised(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset over records with what they come to, by condition and method.

    Parameters
    ----------
    dataset : xarray.Dataset
        Over ``condition``, ``replicate``, ``method``; with ``error``, ``covers``, ``width``, ``elapsed``.
    """
    shape = (dataset.sizes["condition"], dataset.sizes["method"])
    columns = {name: np.full(shape, math.nan) for name in SUMMARY}
    for i, k in np.ndindex(shape):
        one = dataset.isel(condition=i, method=k)
        columns["rms_error"][i, k], columns["rms_error_se"][i, k] = size_of_error(one["error"])
        columns["coverage"][i, k], columns["coverage_se"][i, k] = share_error(one["covers"])
        for name, source in (("median_width", "width"), ("median_elapsed", "elapsed")):
            kept = _kept(one[source])
            columns[name][i, k] = np.median(kept) if kept.size else math.nan
        error = _kept(one["error"])
        columns["bias"][i, k] = error.mean() if error.size else math.nan
    return dataset.assign(
        {
            name: (("condition", "method"), columns[name], {"units": unit, "long_name": meaning})
            for name, (unit, meaning) in SUMMARY.items()
        }
    )


def _error_text(one: xr.Dataset) -> str:
    return with_error(100.0 * float(one["rms_error"]), 100.0 * float(one["rms_error_se"]))


def _coverage_text(one: xr.Dataset) -> str:
    return with_error(100.0 * float(one["coverage"]), 100.0 * float(one["coverage_se"]))


def detail_lines(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """Return one line a condition and one column a method: error; coverage; width, all in percent.

    A last line has the median time on the base record.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :mod:`experiments.method_comparison`.
    """
    methods = dataset["method"].values.tolist()
    lines = []
    for i in range(dataset.sizes["condition"]):
        at = dataset.isel(condition=i)
        texts = {method: _cell(at.sel({"method": method})) for method in methods}
        lines.append({"condition": at["condition"].item()} | texts)
    base = dataset.sel(condition=BASE)["median_elapsed"]
    times = {method: _plain(1e3 * float(base.sel({"method": method})), ".3g") for method in methods}
    return [*lines, {"condition": "median time, ms"} | times]


def _cell(one: xr.Dataset) -> str:
    refused, records = int(_kept(one["refused"]).sum()), _kept(one["refused"]).size
    if refused == records:
        return "refused" if records else "–"
    text = f"{_error_text(one)}; {_coverage_text(one)}; {_plain(100.0 * float(one['median_width']), '.2g')}"
    return f"{text} ({refused} refused)" if refused else text


def _plain(value: float, form: str) -> str:
    return f"{value:{form}}" if math.isfinite(value) else "–"


def summary_rows(dataset: xr.Dataset) -> list[Row]:
    """Return one row a condition: ``waveform``, the paper's method, and the best of the classical ones.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :mod:`experiments.method_comparison`.
    """
    rows = []
    classical = [name for name in dataset["method"].values.tolist() if name not in _OTHERS]
    for i in range(dataset.sizes["condition"]):
        at = dataset.isel(condition=i)
        roots = {name: float(at["rms_error"].sel({"method": name})) for name in classical}
        known = {name: root for name, root in roots.items() if math.isfinite(root)}
        remark = ""
        if known:
            best = min(known, key=known.__getitem__)
            one = at.sel({"method": best})
            remark = f"best classical: {best}, {_error_text(one)} %, covers {_coverage_text(one)} %"
        rows.append(Row(at["condition"].item(), _words(at, OURS), _words(at, PAPER), remark, word(at)))
    return rows


_OTHERS = (OURS, "envelope", PAPER, "normal-gamma, nominal", "gamma-exponential", "emcee")


def _words(at: xr.Dataset, method: str) -> str:
    one = at.sel({"method": method})
    if _kept(one["error"]).size == 0:
        return "refused"
    return f"{_error_text(one)} %, covers {_coverage_text(one)} %"
