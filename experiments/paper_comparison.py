"""Every number of the paper beside ours: ``results/paper_comparison.json`` and a page of the documentation.

``python -m experiments.paper_comparison [--results DIR] [--docs FILE]`` collects what the experiments found;
it computes no estimate. ``python -m experiments`` does the same at its end.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from experiments.paper_numbers import PaperNumber, paper_numbers
from friction_bayes.core.arrays import Array
from friction_bayes.core.files import manifest, write_json

__all__ = ["compare_with_paper", "comparison_page", "needed_results", "write_comparison"]

NAME = "paper_comparison"
OF_SAMPLER = {
    "friction": ("reference_mean", 1.0),
    "error": ("reference_error", 1.0),
    "precision": ("reference_precision", 1.0),
    "noise_sd": ("reference_precision", -0.5),
}
"""What emcee's draws say of a variable of the closed form, and the power that makes it that variable."""


def needed_results() -> tuple[str, ...]:
    """Names of the experiments that the table asks."""
    numbers = paper_numbers().values()
    return tuple(sorted({number.ours["experiment"] for number in numbers if number.ours is not None}))


def compare_with_paper(results: Path) -> dict[str, Any]:
    """Return a row for every number that the paper prints, and for every reading of it.

    Parameters
    ----------
    results : Path
        Folder with the results of :func:`needed_results`.

    Returns
    -------
    dict
        ``rows``, and ``summary`` with their counts.

    Raises
    ------
    FileNotFoundError
        If a result is missing.
    """
    datasets = {}
    for name in needed_results():
        with xr.open_dataset(results / f"{name}.nc", engine="h5netcdf") as stored:
            datasets[name] = stored.load()
    rows = [row for number in paper_numbers().values() for row in _rows_of(number, datasets)]
    compared = [row for row in rows if row["inside"] is not None]
    summary = {
        "numbers": len(paper_numbers()),
        "rows": len(rows),
        "compared": len(compared),
        "inside": sum(row["inside"] for row in compared),
        "fewest_records": min(row["ours"]["records"] for row in compared),
    }
    return {"summary": summary, "rows": rows}


def _rows_of(number: PaperNumber, datasets: Mapping[str, xr.Dataset]) -> Iterator[dict[str, Any]]:
    row = {
        "id": number.id,
        "place": number.place,
        "text": number.text,
        "kind": number.kind,
        "paper": number.value,
        "unit": number.unit,
        "note": number.note,
    }
    if number.ours is None:
        taken = {"median": number.value, "low": number.value, "high": number.value, "records": None}
        yield row | {"reading": "taken over as stated", "ours": taken, "inside": None, "emcee": None}
        return
    dataset = datasets[number.ours["experiment"]].sel(number.ours.get("where", {}))
    for reading in number.ours.get("readings", [""]):
        mine = dataset.sel({"method": reading}) if "method" in dataset.dims else dataset
        other = None
        if "per" in number.ours:
            other = datasets[number.ours["experiment"]].sel(number.ours["per"])
            other = other.sel({"method": reading}) if "method" in other.dims else other
        values = _values(number.ours, mine, number.ours["variable"], other)
        ours = _share(values, number.ours["factor"]) if number.ours.get("share") else _band(values)
        inside = None
        if not number.ours.get("share") and ours["records"] > 1:
            inside = bool(ours["low"] <= number.value <= ours["high"])
        yield row | {
            "reading": reading,
            "ours": ours,
            "inside": inside,
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


def _band(values: Array) -> dict[str, Any]:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return {"median": float(middle), "low": float(low), "high": float(high), "records": values.size}


def _share(values: Array, whole: float) -> dict[str, Any]:
    """Mean of numbers that are 0 or ``whole``, with a band of 1.645 binomial standard errors."""
    mean = float(values.mean())
    half = 1.645 * float(values.std()) / np.sqrt(values.size)
    low, high = max(mean - half, 0.0), min(mean + half, whole)
    return {"median": mean, "low": low, "high": high, "records": values.size}


def _emcee(ours: Mapping[str, Any], mine: xr.Dataset) -> dict[str, Any] | None:
    """What the sampler found on the first record that was checked, beside the closed form there."""
    name, power = OF_SAMPLER.get(ours["variable"], ("", 1.0))
    if name not in mine:
        return None
    checked = np.flatnonzero(np.isfinite(mine[name].values))
    if checked.size == 0:
        return None
    one = mine.isel(replicate=checked[:1])
    return {
        "value": float(_values(ours, one**power, name)[0]),
        "closed_form": float(_values(ours, one, ours["variable"])[0]),
        "nested_rhat": float(one["rhat"].values[0]),
        "ess_bulk": float(one["ess_bulk"].values[0]),
        "ess_tail": float(one["ess_tail"].values[0]),
    }


def comparison_page(comparison: Mapping[str, Any]) -> str:
    """Return the comparison as a page of Markdown."""
    summary, rows = comparison["summary"], comparison["rows"]
    kinds = {"result": "computed by the paper", "measured": "measured by it", "criterion": "its criteria"}
    counts = []
    for kind, words in kinds.items():
        held = [row["inside"] for row in rows if row["kind"] == kind and row["inside"] is not None]
        counts.append(f"{sum(held)} of {len(held)} {words}")
    lines = [
        "# The paper's numbers beside ours",
        "",
        "Written by `python -m experiments.paper_comparison --docs docs/paper_comparison.md` from "
        "`results/paper_comparison.json`; do not edit.",
        "",
        f"{summary['numbers']} numbers of the paper in {summary['rows']} rows: a number that depends on how "
        "a peak is picked has a row for either reading. *Ours* is the median over the records of synthetic "
        f"data (at least {summary['fewest_records']}) and the band that holds 90 % of them. *In* says "
        "whether the paper's number lies in that band. emcee ran on one of the records, by the same "
        "likelihood and prior: its value, the closed form's on the same record, nested R-hat over four "
        "ensembles, bulk and tail effective sample size. Nothing was tuned to agree.",
        "",
        f"In our band: {'; '.join(counts)}. The story is in [paper.md](paper.md).",
        "",
        "| where | words | paper | reading | ours | in | emcee | note |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += ["| " + " | ".join(_cells(row)) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _cells(row: Mapping[str, Any]) -> list[str]:
    ours, emcee = row["ours"], row["emcee"]
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    if ours["records"] is None:
        mine = "as stated"
    elif ours["records"] == 1:
        mine = f"{ours['median']:.3g}{unit}"
    else:
        mine = f"{ours['median']:.4g} [{ours['low']:.4g}, {ours['high']:.4g}]{unit}"
    told = ""
    if emcee is not None:
        told = (
            f"{emcee['value']:.4g} for {emcee['closed_form']:.4g}; R-hat {emcee['nested_rhat']:.4f}, "
            f"ESS {emcee['ess_bulk']:.0f}/{emcee['ess_tail']:.0f}"
        )
    inside = {True: "yes", False: "**no**", None: ""}[row["inside"]]
    return [
        row["place"],
        row["text"],
        f"{row['paper']:g}{unit}",
        row["reading"],
        mine,
        inside,
        told,
        row["note"],
    ]


def write_comparison(results: Path, docs: Path | None = None) -> Path:
    """Write ``paper_comparison.json`` into ``results`` and, where asked, the page; return the former."""
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
    if missing := [name for name in needed_results() if not (options.results / f"{name}.nc").exists()]:
        parser.error(
            f"{options.results} has no {missing[0]}.nc: run python -m experiments {missing[0]} first"
        )
    print(f"{write_comparison(options.results, options.docs)} written", file=sys.stderr)


if __name__ == "__main__":
    main()
