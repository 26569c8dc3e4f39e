"""Tables of the comparison of methods, every figure with its Monte Carlo error."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from experiments.tables import Row

__all__ = ["detail_lines", "share_error", "size_of_error", "summary_rows"]

OURS, PAPER = "waveform", "normal-gamma, highest"


def _kept(values: xr.DataArray) -> NDArray[np.float64]:
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


def _with_error(value: float, error: float, digits: int = 2) -> str:
    """Write a value to the decimals that its error leaves it."""
    if not math.isfinite(value):
        return "–"
    if not math.isfinite(error) or error == 0.0:
        return f"{value:.{digits}g}"
    decimals = max(0, -math.floor(math.log10(error)) + (1 if error < 1.0 else 0) - 1)
    return f"{value:.{decimals}f} ± {error:.{decimals}f}" if value < 1e4 else f"{value:.2g} ± {error:.1g}"


def _error_text(one: xr.Dataset) -> str:
    root, spread = size_of_error(one["error"])
    return _with_error(100.0 * root, 100.0 * spread)


def _coverage_text(one: xr.Dataset) -> str:
    share, spread = share_error(one["covers"])
    return _with_error(100.0 * share, 100.0 * spread)


def detail_lines(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """Return one line a condition and method: error, bias, coverage, width, time, refusals.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :mod:`experiments.method_comparison`.
    """
    lines = []
    for i, condition in enumerate(dataset["condition"].values.tolist()):
        for method in dataset["method"].values.tolist():
            one = dataset.isel(condition=i).sel({"method": method})
            error, width, elapsed = (_kept(one[name]) for name in ("error", "width", "elapsed"))
            refused = int(_kept(one["refused"]).sum())
            if error.size + refused == 0:
                continue
            lines.append(
                {
                    "condition": condition,
                    "method": method,
                    "RMS error %": _error_text(one),
                    "bias %": f"{100.0 * error.mean():+.2g}" if error.size else "–",
                    "90 % interval covers %": _coverage_text(one),
                    "its width %": f"{100.0 * np.median(width):.2g}" if width.size else "–",
                    "time ms": f"{1e3 * np.median(elapsed):.3g}" if elapsed.size else "–",
                    "records": f"{error.size}",
                    "refused": f"{refused}" if refused else "",
                }
            )
    return lines


def summary_rows(dataset: xr.Dataset) -> list[Row]:
    """Return one row a condition: ``waveform`` beside the paper's method, and the best of the classical ones.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of :mod:`experiments.method_comparison`.
    """
    rows = []
    classical = [name for name in dataset["method"].values.tolist() if name not in _OTHERS]
    for i, condition in enumerate(dataset["condition"].values.tolist()):
        at = dataset.isel(condition=i)
        roots = {name: size_of_error(at["error"].sel({"method": name}))[0] for name in classical}
        known = {name: root for name, root in roots.items() if math.isfinite(root)}
        remark = ""
        if known:
            best = min(known, key=known.__getitem__)
            one = at.sel({"method": best})
            remark = f"best classical: {best}, {_error_text(one)} %, covers {_coverage_text(one)} %"
        rows.append(Row(condition, _words(at, OURS), _words(at, PAPER), remark))
    return rows


_OTHERS = (OURS, "envelope", PAPER, "normal-gamma, nominal", "gamma-exponential", "emcee")


def _words(at: xr.Dataset, method: str) -> str:
    one = at.sel({"method": method})
    if _kept(one["error"]).size == 0:
        return "refused"
    return f"{_error_text(one)} %, covers {_coverage_text(one)} %"
