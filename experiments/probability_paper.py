"""Are the friction samples normal, and independent? Normal probability paper, section 3."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from scipy import stats

import friction_bayes as fb
from experiments.against_paper import band
from experiments.method_tables import with_error
from experiments.paper_numbers import printed
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row
from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.testbed import PAPER_SYSTEM, paper_example

__all__ = ["EXPERIMENT", "Config"]

VARIABLES = {
    "straightness": ("1", "correlation of the sorted samples with normal quantiles"),
    "normal_p": ("1", "p-value of Shapiro and Wilk's test of normality"),
    "lag1": ("1", "correlation of successive samples"),
    "spread_of_mean": ("1", "error of the mean over the standard error that independence gives it"),
}


@dataclass(frozen=True)
class Config:
    """Records, how the peaks are picked, and the number of samples whose order the figure shows."""

    records: int = 200
    records_full: int = 2000
    peaks: tuple[str, ...] = ("highest", "nominal")
    drawn: int = int(printed("example-amplitudes"))


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One record a cell."""
    return [{"replicate": i} for i in range(config.records_full if full else config.records)]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Friction samples of one record of the paper's example, by either reading of a peak."""
    record = paper_example(int(seed.generate_state(1)[0]))
    found: dict[str, Any] = {name: [] for name in (*VARIABLES, "samples")}
    for peaks in config.peaks:
        estimate = fb.estimate(record, PAPER_SYSTEM, method="normal-gamma", peaks=peaks)
        samples = np.asarray(estimate.fit.target.observed)
        centred = samples - samples.mean()
        found["straightness"].append(float(stats.probplot(samples)[1][2]))
        found["normal_p"].append(float(stats.shapiro(samples).pvalue))
        found["lag1"].append(float(centred[1:] @ centred[:-1] / (centred @ centred)))
        standard_error = samples.std(ddof=1) / np.sqrt(samples.size)
        found["spread_of_mean"].append((samples.mean() - printed("example-friction")) / standard_error)
        # order statistics of another number of samples have other quantiles
        whole = samples.size == config.drawn
        found["samples"] += np.sort(samples).tolist() if whole else [math.nan] * config.drawn
    return {"peaks": list(config.peaks), **found}


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions replicate, peaks; ``samples`` sorted along ``rank``, with the normal quantile of each.

    A record that gives another number of samples than are drawn has none of them there.
    """
    peaks = results[0]["peaks"]
    dataset = lay_out(cells, results, dims=("replicate",), variables=VARIABLES, inner={"peaks": peaks})
    samples = np.array([result["samples"] for result in results], dtype=np.float64)
    samples = samples.reshape(len(results), len(peaks), -1)
    n = samples.shape[-1]
    # Filliben's medians of the order statistics
    share = (np.arange(1, n + 1) - 0.3175) / (n + 0.365)
    share[[0, -1]] = 1.0 - 0.5 ** (1.0 / n), 0.5 ** (1.0 / n)
    return dataset.assign(
        samples=(("replicate", "peaks", "rank"), samples, {"units": "N", "long_name": "friction sample"}),
        quantile=("rank", stats.norm.ppf(share), {"units": "1", "long_name": "normal quantile"}),
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """Straightness, and what the paper did not look at: whether the samples are independent."""
    table = []
    for peaks in dataset["peaks"].values.tolist():
        mine = dataset.sel(peaks=peaks)
        refused = float((mine["normal_p"] < 0.05).mean())
        table += [
            Row(
                f"{peaks}: straightness on probability paper",
                band(mine["straightness"], digits=4),
                "well approximated with a straight line",
                f"a test of normality at 5 % refuses {100.0 * refused:.0f} % of the records",
            ),
            Row(
                f"{peaks}: correlation of successive samples",
                band(mine["lag1"]),
                "taken as 0",
                "samples that share an amplitude: -1/2",
            ),
            Row(
                f"{peaks}: RMS error of the mean over the standard error claimed",
                _root_mean_square(mine["spread_of_mean"].values),
                "1",
                "drops telescope: the mean depends on the first and the last amplitude alone",
            ),
        ]
    return table


def _root_mean_square(values: Array) -> str:
    """Root of the mean square with its Monte Carlo error, that of the mean square over twice the root."""
    squares = values**2
    root = math.sqrt(float(squares.mean()))
    return with_error(root, float(squares.std(ddof=1)) / math.sqrt(squares.size) / (2.0 * root))


EXPERIMENT = Experiment(
    name="probability_paper",
    question="are the friction samples normal, and independent?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
