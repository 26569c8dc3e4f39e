"""One page on the replication, in the form of the journal ReScience, its numbers taken from results.

``python -m experiments.article [--results DIR] [--docs FILE]``; it computes no estimate.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_paper import band
from experiments.method_tables import with_error
from experiments.paper_comparison import compare_with_paper, needed_results
from experiments.paper_numbers import printed
from experiments.paper_page import CHOSEN, OTHER, by_chance, counted, smaller_errors
from experiments.sources import stored_result, why_not_usable
from friction_bayes.core.arrays import Array
from friction_bayes.decay.friction_samples import PEAKS

__all__ = ["article", "needed_by_article"]

TEMPLATE = Path(__file__).with_name("article.md")
"""The words, with names in braces where numbers go."""


def needed_by_article() -> tuple[str, ...]:
    """Names of the experiments whose numbers the article quotes."""
    own = (
        "acceptance_roc",
        "gamma_exponential",
        "noise_sweep",
        "prior_sweep",
        "probability_paper",
        "random_force_verdict",
        "residuals_traced",
    )
    return tuple(sorted({*own, *needed_results()}))


def article(results: Path) -> str:
    """Return the article in Markdown.

    Parameters
    ----------
    results : Path
        Folder with the results of :func:`needed_by_article`.

    Raises
    ------
    FileNotFoundError
        If a result is missing, or is of other sources than these.
    """
    for name in needed_by_article():
        if reason := why_not_usable(name, results):
            raise FileNotFoundError(reason)
    rows = {row["id"]: row for row in compare_with_paper(results)["rows"]}
    filled = _of_numbers(rows) | _of_datasets(results) | _of_errors_together(results)
    filled |= _of_priors(stored_result("prior_sweep", results))
    filled |= _of_random_force(stored_result("random_force_verdict", results)) | _environment(results)
    text = TEMPLATE.read_text(encoding="utf-8")
    for name, value in filled.items():
        text = text.replace(f"{{{name}}}", value)
    return text


def _of_numbers(rows: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """The paper's numbers, ours, and the counts of verdicts."""
    filled = {}
    for name, row in rows.items():
        filled[f"paper:{name}"] = f"{row['paper']:g}"
        if CHOSEN in row["ours"] and OTHER in row["ours"]:
            bands = (
                f"{one['median']:.3g} [{one['low']:.3g}, {one['high']:.3g}]" for one in row["ours"].values()
            )
            filled[f"row:{name}"] = " | ".join([f"{row['paper']:g} {row['unit']}", *bands])
            filled[f"median:{name}"] = f"{row['ours'][CHOSEN]['median']:.3g}"
    all_rows = list(rows.values())
    for without, kind in ((None, ""), ("mass", "_free")):
        for reading, end in ((CHOSEN, ""), (OTHER, "_other")):
            counts = counted(all_rows, reading, without=without)
            filled |= {f"{word}{end}{kind}": str(n) for word, n in counts.items()}
        own = sum(counts.values())
        filled |= {f"own{kind}": str(own), f"chance{kind}": by_chance(own)}
    estimate = rows["example-estimate"]["ours"][CHOSEN]
    return filled | {
        "smaller": ", ".join(smaller_errors(all_rows, CHOSEN)) or "none",
        "records": str(estimate["records"]),
    }


def _of_datasets(results: Path) -> dict[str, str]:
    """Results of experiments that are not in the table of numbers."""
    names = ("probability_paper", "acceptance_roc", "residuals_traced", "noise_sweep", "gamma_exponential")
    samples, areas, traced, noise, rate = (stored_result(name, results) for name in names)
    stated = noise.sel(snr_db=21.59, method="nearest")
    rms = {
        method: 100.0 * float(np.sqrt((stated["error"].sel({"method": method}) ** 2).mean()))
        for method in ("waveform", CHOSEN)
    }
    covers = stated["covers"].sel({"method": CHOSEN})
    grid = traced["error"].sel(step="grid alone", sampling_rate=10.0)
    claimed = np.sqrt((samples["spread_of_mean"] ** 2).mean("replicate"))
    filled = {
        "rate": band(rate["estimate"].sel(friction=0.07)),
        "grid": f"{-100.0 * float(grid.median()):.0f}",
        "lag": f"{float(samples['lag1'].median()):.2f}",
        "claimed": " to ".join(f"{value:.2f}" for value in sorted(claimed.values.tolist())),
        "covers": f"{int(covers.sum())} of {int(covers.notnull().sum())}",
        "whole": f"{rms['waveform']:.2g}",
        "procedure": f"{rms[CHOSEN]:.2g}",
    }
    sweeps = [noise, *(stored_result(name, results) for name in ("reduced_data_set", "sampling_rate_sweep"))]
    verdicts = np.concatenate([_verdicts(sweep, method) for sweep in sweeps for method in (CHOSEN, OTHER)])
    filled["agree"] = f"{int(verdicts.sum())} of {verdicts.size}"
    for criterion in ("precision", "whole-signal width"):
        area = areas["area"].sel(criterion=criterion)
        filled[f"area:{criterion}"] = " and ".join(
            f"{float(area.sel({'method': method})):.2f}" for method in (CHOSEN, OTHER)
        )
    return filled


def _of_priors(swept: xr.Dataset) -> dict[str, str]:
    """Every claim under next to no prior, highest and nominal peaks, and under how many others it holds."""
    grid = [name for name in swept["prior"].values.tolist() if name.startswith("grid ")]
    filled = {"priors": str(len(grid))}
    for claim in swept["claim"].values.tolist():
        one = swept.sel(claim=claim)
        plain, held = one.sel(prior="next to none"), (one["verdict"].sel(prior=grid) == 1.0).sum("prior")
        pairs = zip(plain["value"].values, plain["monte_carlo_error"].values, strict=True)
        filled[f"claim:{claim}"] = " and ".join(with_error(*pair) for pair in pairs)
        filled[f"held:{claim}"] = " / ".join(str(n) for n in held.values.tolist())
    return filled


def _of_random_force(found: xr.Dataset) -> dict[str, str]:
    """Results under the largest force and under none, at the paper's noise."""
    usual = found.isel(condition=(found["noise"] == printed("example-noise")) & (found["time"] == 0.1))
    by_size = usual.sortby("size")
    without, with_force = by_size.isel(condition=0), by_size.isel(condition=-1)
    left = with_force["precision"].median("replicate") / without["precision"].median("replicate")
    covered = with_force["covers"]
    shares = [f"{100.0 * float(left.sel({'method': reading})):.0f}" for reading in (CHOSEN, OTHER)]
    return {
        "force": f"{100.0 * float(with_force['size']):.0f}",
        "left": " and ".join(shares) + " % (highest, nominal)",
    } | {
        name: f"{int(covered.sel({'method': label}).sum())} of {covered.sizes['replicate']}"
        for name, label in (("white", "waveform, white noise alone"), ("random", "waveform, random force"))
    }


def _of_errors_together(results: Path) -> dict[str, str]:
    """How often three records are as close as the paper's three errors, from the table of the noise sweep."""
    record = json.loads((results / "noise_sweep.json").read_text(encoding="utf-8"))
    ours = {row["what"]: row["ours"] for row in record["table"]}
    found = {}
    for what in ("all three, if independent", "Fisher's combined test"):
        found[what] = " and ".join(ours[f"three errors, {method}: {what}"] for method in (CHOSEN, OTHER))
    line = (f"three errors, straight line, {peaks}: Fisher's combined test" for peaks in PEAKS)
    return found | {"straight line": " and ".join(ours[what] for what in line)}


def _verdicts(sweep: xr.Dataset, method: str) -> Array:
    """Whether closed form and emcee agree, of the records that were checked."""
    agrees = sweep["agrees"].sel({"method": method}).values
    return np.asarray(agrees[np.isfinite(agrees)])


def _environment(results: Path) -> dict[str, str]:
    """Versions, system and processor times, from the manifests of the experiments of the paper."""
    found = sorted(results.glob("*.json"))
    records = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in found}
    runs = {
        name: record
        for name, record in records.items()
        if record.get("group") == "paper" and why_not_usable(name, results) is None
    }
    one = runs["noise_sweep"]
    versions = ", ".join(f"{name} {version}" for name, version in one["versions"].items() if version)
    return {
        "versions": versions,
        "system": one["platform"].partition("-")[0],
        "seed": str(one["seed"]),
        "minutes": f"{sum(record['processor_s'] for record in runs.values()) / 60.0:.0f}",
        "times": ", ".join(f"{name} {record['processor_s']:.0f} s" for name, record in runs.items()),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Write the article."""
    parser = argparse.ArgumentParser(prog="python -m experiments.article", description=__doc__)
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder (default %(default)s)")
    parser.add_argument("--docs", type=Path, metavar="FILE", help="page to write; printed by default")
    options = parser.parse_args(argv)
    try:
        text = article(options.results)
    except FileNotFoundError as error:
        parser.error(str(error))
    if options.docs is None:
        sys.stdout.write(text)
    else:
        options.docs.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
