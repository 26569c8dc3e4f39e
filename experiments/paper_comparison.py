"""Every number of the paper and ours: ``results/paper_comparison.json`` and a page of the documentation.

``python -m experiments.paper_comparison [--results DIR] [--docs FILE]`` collects what the experiments found;
it computes no estimate. ``python -m experiments`` does the same at its end.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from experiments.paper_numbers import PaperNumber, paper_numbers
from experiments.paper_page import comparison_page
from experiments.sources import stored_result, why_not_usable
from friction_bayes.core.arrays import Array
from friction_bayes.core.files import manifest, write_json

__all__ = ["compare_with_paper", "needed_results", "write_comparison"]

NAME = "paper_comparison"
OF_SAMPLER = {
    "friction": ("reference_mean", 1.0),
    "error": ("reference_error", 1.0),
    "precision": ("reference_precision", 1.0),
    "noise_sd": ("reference_precision", -0.5),
}
"""By variable of the closed form: emcee's, and the power that makes it that variable."""


def needed_results() -> tuple[str, ...]:
    """Names of the experiments that the table reads."""
    numbers = paper_numbers().values()
    return tuple(sorted({number.ours["experiment"] for number in numbers if number.ours is not None}))


def compare_with_paper(results: Path) -> dict[str, Any]:
    """Return a row for every number that the paper prints.

    Parameters
    ----------
    results : Path
        Folder with the results of :func:`needed_results`.

    Returns
    -------
    dict
        ``rows``: of each number ``id``, ``place``, ``text``, ``kind``, ``restates``, ``scales_with``,
        ``paper``, ``unit`` and ``note``, and ``ours``, empty for an input that is taken over; by reading of
        "peak" (one without a name where none applies) it has ``median``, ``low``, ``high``, the Monte Carlo
        errors of the last two, ``records``, ``verdict``, ``smaller_error`` (whether it is out for being an
        error smaller than ours) and ``emcee``.

    Raises
    ------
    FileNotFoundError
        If a result is missing.
    """
    datasets = {name: stored_result(name, results) for name in needed_results()}
    return {"rows": [_row_of(number, datasets) for number in paper_numbers().values()]}


def _row_of(number: PaperNumber, datasets: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    row = {
        "id": number.id,
        "place": number.place,
        "text": number.text,
        "kind": number.kind,
        "restates": number.restates,
        "scales_with": number.scales_with,
        "paper": number.value,
        "unit": number.unit,
        "note": number.note,
    }
    if number.ours is None:
        return row | {"ours": {}}
    readings = number.ours.get("readings", [""])
    return row | {"ours": {reading: _reading(number, reading, datasets) for reading in readings}}


def _reading(number: PaperNumber, reading: str, datasets: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    assert number.ours is not None

    def taken(where: Mapping[str, Any]) -> xr.Dataset:
        level = datasets[number.ours["experiment"]].sel(where)
        return level.sel({"method": reading}) if "method" in level.dims else level

    mine = taken(number.ours.get("where", {}))
    other = taken(number.ours["per"]) if "per" in number.ours else None
    values = _values(number.ours, mine, number.ours["variable"], other)
    if number.ours.get("share"):
        return _share(values, number.ours["factor"]) | {"verdict": None, "emcee": None}
    ours = band_with_errors(values)
    judged = verdict(number.value, ours) if number.kind == "result" else None
    return ours | {
        "verdict": judged,
        "smaller_error": judged == "out" and "size" in number.ours and number.value < ours["low"],
        "emcee": None if other is not None else _emcee(number.ours, mine),
    }


def _values(
    ours: Mapping[str, Any], mine: xr.Dataset, variable: str, other: xr.Dataset | None = None
) -> Array:
    """One number a record, in the paper's unit."""
    values = mine[variable]
    if other is not None:
        values = values / other[variable]
    numbers = np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()
    numbers = numbers[np.isfinite(numbers)] ** ours.get("power", 1.0) * ours.get("factor", 1.0)
    return np.abs(numbers) if ours.get("size") else numbers


def band_with_errors(values: Array) -> dict[str, Any]:
    """Return the median and the 90 % band of records, with the Monte Carlo errors of its edges.

    The error of an edge is half the distance between the quantiles one binomial standard error of its rank to
    either side, ``sqrt(p (1 - p) / n)``.

    Parameters
    ----------
    values : ndarray, shape (records,)

    Returns
    -------
    dict
        ``median``, ``low``, ``high``, ``low_error``, ``high_error`` and ``records``.
    """
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    step = np.sqrt(0.05 * 0.95 / values.size)
    errors = []
    for p in (0.05, 0.95):
        below, above = np.quantile(values, np.clip([p - step, p + step], 0.0, 1.0))
        errors.append(0.5 * float(above - below))
    return {
        "median": float(middle),
        "low": float(low),
        "high": float(high),
        "low_error": errors[0],
        "high_error": errors[1],
        "records": values.size,
    }


def verdict(paper: float, ours: Mapping[str, Any]) -> str | None:
    """Return whether the paper's number lies "in" our band or "out" of it; None where one record is no band.

    It is "undecided" where an edge of the band is nearer to the number than its Monte Carlo error.

    Parameters
    ----------
    paper : float
    ours : mapping
        Of :func:`band_with_errors`.
    """
    if ours["records"] == 1:
        return None
    if any(abs(paper - ours[edge]) < ours[f"{edge}_error"] for edge in ("low", "high")):
        return "undecided"
    return "in" if ours["low"] <= paper <= ours["high"] else "out"


def _share(values: Array, whole: float) -> dict[str, Any]:
    """Mean of numbers that are 0 or ``whole``, with a band of 1.645 binomial standard errors."""
    mean = float(values.mean())
    half = 1.645 * float(values.std()) / np.sqrt(values.size)
    low, high = max(mean - half, 0.0), min(mean + half, whole)
    return {"median": mean, "low": low, "high": high, "records": values.size}


def _emcee(ours: Mapping[str, Any], mine: xr.Dataset) -> dict[str, Any] | None:
    """What the sampler found on the records that were checked, and the closed form there."""
    name, power = OF_SAMPLER.get(ours["variable"], ("", 1.0))
    if name not in mine:
        return None
    checked = np.flatnonzero(np.isfinite(mine[name].values))
    if checked.size == 0:
        return None
    sampled = mine.isel(replicate=checked)
    return {
        "value": float(_values(ours, sampled**power, name).mean()),
        "closed_form": float(_values(ours, sampled, ours["variable"]).mean()),
        "records": checked.size,
        "nested_rhat": float(sampled["rhat"].max()),
        "ess_bulk": float(sampled["ess_bulk"].min()),
        "ess_tail": float(sampled["ess_tail"].min()),
    }


def write_comparison(results: Path, docs: Path | None = None) -> Path:
    """Write ``paper_comparison.json`` into ``results`` and, with ``docs``, the page; return the former."""
    comparison = compare_with_paper(results)
    target = results / f"{NAME}.json"
    command = f"python -m experiments.{NAME}"
    write_json(target, manifest(command, options={"results": needed_results()}, seed=None) | comparison)
    if docs is not None:
        docs.write_text(comparison_page(comparison), encoding="utf-8")
    return target


def main(argv: Sequence[str] | None = None) -> None:
    """Collect and write."""
    parser = argparse.ArgumentParser(prog=f"python -m experiments.{NAME}", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument("--docs", type=Path, metavar="FILE", help="write the page too")
    options = parser.parse_args(argv)
    for name in needed_results():
        if reason := why_not_usable(name, options.results):
            parser.error(reason)
    print(f"{write_comparison(options.results, options.docs)} written", file=sys.stderr)


if __name__ == "__main__":
    main()
