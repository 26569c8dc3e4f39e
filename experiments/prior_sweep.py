"""Which of the paper's claims depend on its prior? Every claim of section 3 and Table 2 under many priors.

The paper shows its priors as pictures. Here the friction samples of each record are taken once, and every
prior updates the same samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from experiments.acceptance_roc import GOOD
from experiments.against_emcee import CHECKED, SAMPLED, sampled_pair, verdict_rows
from experiments.claims import After, Claim, quantiles
from experiments.friction_statistics import (
    ALL,
    EVERY_COUNT,
    KEEP_EVERY,
    MASS,
    SNR_DB,
    VARIABLES,
    Samples,
    at_noise,
    collect,
    heavy,
)
from experiments.method_tables import with_error
from experiments.paper_numbers import printed
from experiments.prior_claims import CLAIMS, GROWING
from experiments.rig import Rig
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row
from experiments.testbed_choices import DRAWN_PRIOR
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.decay.friction_samples import PEAKS

__all__ = ["EXPERIMENT", "NAMED", "Config", "shape_and_rate_for"]

NAMED: dict[str, dict[str, float]] = {
    "next to none": {"mu": 0.0, "lam": 1e-9, "alpha": 0.5, "beta": 1e-12},
    "as drawn": DRAWN_PRIOR,
    "two samples, mean 5": {"mu": 0.5, "lam": 0.05, "alpha": 1.0, "beta": 0.2},
    "38 samples, mean 125": {"mu": 0.5, "lam": 0.05, "alpha": 18.8, "beta": 0.15},
}
"""The package's default in all but its digits; what our figures draw; a weak prior of small precision; and
what it takes, at 19.5 kg, to turn the scatter of white noise into the paper's 11.6 and 32.2."""
BAND = (0.05, 0.5, 0.95)
PARAMETERS = ("mu", "lam", "alpha", "beta")
DECREASED_TO = printed("precision-reduced")
"""Posterior precision of the reduced set [1/N^2], to which the paper has the precision decrease."""
FAR = 0.5
"""Prior friction where convergence is shown [N], seven times the truth: "quite far", as the paper's own."""
PULLS = (0.0, 0.05, 0.5, 2.0, 10.0, 50.0)
"""Its weights, from the widest prior to the narrowest [samples]."""


IN_TABLES = (
    ALL,
    *(at_noise(level) for level in SNR_DB),
    heavy("1"),
    heavy("2"),
    *(heavy("2-reduced", step) for step in KEEP_EVERY),
)
"""Conditions on which priors with a name go through emcee: those of the paper's sections 3 and 4."""


@dataclass(frozen=True)
class Config:
    """Records, and the grid of priors: friction [N] with its weight, precision [1/N^2] with its own.

    A weight is the number of samples that the prior is worth: ``lam``, and ``2 alpha``. On ``checked``
    records the priors with a name go through emcee under the conditions of :data:`IN_TABLES`, and those of
    the grid, dealt out among these records, on the example.
    """

    rig: Rig = field(default_factory=Rig)
    records: int = 200
    records_full: int = 1000
    checked: int = CHECKED
    friction_means: tuple[float, ...] = (0.0, 0.5)
    friction_weights: tuple[float, ...] = (0.05, 2.0)
    precision_means: tuple[float, ...] = (1.0, 5.0, 25.0, 125.0, 625.0)
    precision_weights: tuple[float, ...] = (0.5, 1.0, 2.0, 5.0, 10.0, 40.0)


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One replicate of the example and of the testbed a cell."""
    records = config.records_full if full else config.records
    return [{"replicate": i, "check": i < config.checked} for i in range(records)]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Friction samples of one replicate under every condition, and the priors that are to update them."""
    of_noise, of_sampler = seeds_of(cell, seed)
    found, priors = collect(config.rig, of_noise), _priors(config)
    statistics = [one.statistics() for one in found.values()]
    columns = {name: [value for one in statistics for value in one[name]] for name in VARIABLES}
    computed = {"condition": list(found), "priors": priors, **columns}
    if not cell["check"]:
        return computed
    named, grid = priors[: len(NAMED)], priors[len(NAMED) :]
    own = range(cell["replicate"], len(grid), config.checked)
    checks = [(prior, found[name]) for prior in named for name in IN_TABLES]
    checks_of_grid = [(prior, found[ALL] if i in own else None) for i, prior in enumerate(grid)]
    return computed | _sampled(checks, of_sampler) | _of_grid(_sampled(checks_of_grid, of_sampler))


def _sampled(checks: Sequence[tuple[Sequence[float], Samples | None]], seed: int) -> dict[str, list[float]]:
    """Names of :data:`SAMPLED`, a number a check and reading of a peak; nan where there are no samples."""
    columns: dict[str, list[float]] = {name: [] for name in SAMPLED}
    for prior, record in checks:
        for k in range(len(PEAKS)):
            samples = np.empty(0) if record is None else record.by_peaks[k]
            found = sampled_pair(NormalGamma(*prior), samples, seed=seed) if samples.size else {}
            for name, column in columns.items():
                column.append(found.get(name, math.nan))
    return columns


def _of_grid(named: Mapping[str, Any]) -> dict[str, Any]:
    """Names for what is of the priors of the grid."""
    return {f"grid_{name}": each for name, each in named.items()}


def _priors(config: Config) -> list[list[float]]:
    """Parameters of every prior: those with a name first, then the grid."""
    grid = product(
        config.friction_means, config.friction_weights, config.precision_means, config.precision_weights
    )
    named = [[prior[name] for name in PARAMETERS] for prior in NAMED.values()]
    return named + [[mu, lam, 0.5 * weight, 0.5 * weight / mean] for mu, lam, mean, weight in grid]


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Statistics over replicate, condition, peaks; claims over prior, claim, peaks; convergence by weight."""
    inner = {"condition": results[0]["condition"], "peaks": PEAKS}
    data = lay_out(cells, results, dims=("replicate",), variables=VARIABLES, inner=inner)
    data = data.transpose("replicate", "peaks", "condition")
    checks = _checks(cells, results)
    priors = np.array(results[0]["priors"])
    shape = (len(priors), len(CLAIMS), len(PEAKS))
    value, error, verdict = (np.full(shape, math.nan) for _ in range(3))
    for i, parameters in enumerate(priors):
        after = After(NormalGamma(*parameters), data)
        for j, claim in enumerate(CLAIMS):
            value[i, j], error[i, j] = claim.numbers(after)
            verdict[i, j] = claim.verdict(value[i, j], error[i, j])
    dims = ("prior", "claim", "peaks")
    names = [*NAMED, *(f"grid {i + 1}" for i in range(len(priors) - len(NAMED)))]
    rms = [np.sqrt((_growing(data, weight) ** 2).mean("replicate")) for weight in PULLS]
    bands = [quantiles(After(NormalGamma(*prior), data).precision, BAND) for prior in priors[: len(NAMED)]]
    return (
        data.assign(
            value=(dims, value, {"long_name": "what a claim comes to, in its own unit"}),
            monte_carlo_error=(dims, error, {"long_name": "its Monte Carlo standard error"}),
            verdict=(dims, verdict, {"units": "1", "long_name": "1 holds, -1 does not, 0 undecided"}),
            growing_rms=(
                ("friction_weight", "peaks", "samples"),
                np.array([each.transpose("peaks", "condition").values for each in rms]),
                {"units": "1", "long_name": "RMS error of the friction, prior at 0.5 N"},
            ),
            precision_band=(
                ("named", "quantile", "peaks", "condition"),
                np.array([band.transpose("quantile", "peaks", "condition").values for band in bands]),
                {"units": "1/N^2", "long_name": "posterior mean of the precision over the replicates"},
            ),
            **{name: ("prior", priors[:, k]) for k, name in enumerate(PARAMETERS)},
        )
        .merge(checks)
        .assign_coords(
            prior=names,
            claim=[claim.name for claim in CLAIMS],
            named=list(NAMED),
            quantile=list(BAND),
            friction_weight=list(PULLS),
            samples=list(EVERY_COUNT),
        )
    )


def _checks(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Results of emcee: over checked, named, in_tables, peaks, and over checked, grid, peaks."""
    pairs = [(cell, result) for cell, result in zip(cells, results, strict=True) if cell["check"]]
    if not pairs:
        return xr.Dataset()
    checked, found = zip(*pairs, strict=True)
    grid = range(len(found[0]["priors"]) - len(NAMED))
    parts = [
        lay_out(checked, found, dims=("replicate",), variables=variables, inner=inner | {"peaks": PEAKS})
        for variables, inner in (
            (SAMPLED, {"named": list(NAMED), "in_tables": list(IN_TABLES)}),
            (_of_grid(SAMPLED), {"grid": grid}),
        )
    ]
    return xr.merge(parts).rename(replicate="checked")


def _growing(data: xr.Dataset, weight: float) -> xr.DataArray:
    """Error as friction samples come in, under a prior of the friction alone."""
    return After(NormalGamma(FAR, weight, 0.5, 0.0), data).error.sel(condition=GROWING)


def shape_and_rate_for(
    mass: float, noise: float, counts: tuple[float, float], means: tuple[float, float]
) -> tuple[float, float]:
    """Gamma prior by which white noise at nominal peaks gives two posterior precisions.

    ``(alpha + n/2) / (beta + n v/2)`` has to be each mean for its count ``n``, with ``v = (m noise)^2 / 8``
    the variance of a friction sample.

    Parameters
    ----------
    mass : float
        [kg].
    noise : float
        Of the accelerometer [m/s2].
    counts : tuple of float
        Friction samples of both records.
    means : tuple of float
        Their posterior mean precisions [1/N^2].
    """
    variance = (mass * noise) ** 2 / 8.0
    n, s = np.array(counts), np.array(means)
    alpha, beta = np.linalg.solve(np.column_stack([np.ones(2), -s]), 0.5 * n * (s * variance - 1.0))
    return float(alpha), float(beta)


def least_mass(noise: float, counts: tuple[float, float], means: tuple[float, float]) -> float:
    """Mass [kg] above which :func:`shape_and_rate_for` has a rate above zero, for a larger second mean."""
    (n, few), (s, more) = counts, means
    return math.sqrt(8.0 * (n - few) / (s * n - more * few)) / noise


def rows(dataset: xr.Dataset) -> list[Row]:
    """Under how many priors of the grid each claim holds; convergence; the prior that set 2 requires.

    "The precision parameter decreases" on the reduced set, section 4, where it is higher than on the full
    one (11.6 to 32.2): most likely from prior to posterior, so that the prior mean, which both share, was
    above 32.2. Claims are counted under those priors too.
    """
    grid = dataset.isel(prior=slice(len(NAMED), None))
    table = [_claim_row(grid, claim) for claim in CLAIMS] + _pull_rows(dataset) + _mass_rows(dataset)
    return table + (_verdicts(dataset) if "rhat" in dataset else [])


def _verdicts(dataset: xr.Dataset) -> list[Row]:
    """Closed forms against emcee: priors with a name under all conditions, the grid on the example."""
    of_grid = dataset[list(_of_grid(SAMPLED))].rename({f"grid_{name}": name for name in SAMPLED})
    grid = [replace(row, what=f"{row.what}, priors of the grid") for row in verdict_rows(of_grid, "peaks")]
    return verdict_rows(dataset[list(SAMPLED)], "named") + grid


def _claim_row(grid: xr.Dataset, claim: Claim) -> Row:
    mine = grid.sel(claim=claim.name)
    low, high = (mine["value"].reduce(limit, "prior").values for limit in (np.min, np.max))
    ranges = " / ".join(f"{a:.2g} to {b:.2g}" for a, b in zip(low, high, strict=True))
    if not mine["verdict"].notnull().any():
        return Row(claim.name, ranges, claim.paper, claim.says)
    held, open_ = ((mine["verdict"] == code).sum("prior").values for code in (1, 0))
    ours = " / ".join(f"{a} (+{b})" for a, b in zip(held, open_, strict=True))
    above = mine["verdict"].isel(prior=np.flatnonzero(grid["alpha"] / grid["beta"] > DECREASED_TO))
    under = " / ".join(str(n) for n in (above == 1.0).sum("prior").values)
    return Row(
        claim.name,
        f"{ours} of {mine.sizes['prior']}",
        claim.paper,
        f"{under} of the {above.sizes['prior']} with a mean precision above {DECREASED_TO:g}; "
        f"{claim.says}: {ranges}",
    )


def _pull_rows(dataset: xr.Dataset) -> list[Row]:
    """Friction samples from which on the RMS error of the friction stays within 10 %."""
    table = []
    for weight in dataset["friction_weight"].values.tolist():
        counts = []
        for peaks in PEAKS:
            far = (dataset["growing_rms"].sel(friction_weight=weight, peaks=peaks) > GOOD).values
            first = int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0
            counts.append(f"{dataset['samples'].values[first]}" if first < far.size else "never")
        table.append(
            Row(
                f"prior friction {FAR:g} N worth {weight:g} samples: friction samples until within 10 %",
                " / ".join(counts),
                "a too wide or narrow prior: very slow",
                "RMS error of the friction",
            )
        )
    return table


def _mass_rows(dataset: xr.Dataset) -> list[Row]:
    """Gamma priors by which white noise gives 11.6 on set 2 and 32.2 on its reduced part, by mass."""
    counts = [
        float(dataset["count"].sel(condition=heavy(data_set), peaks="nominal").median())
        for data_set in ("2", "2-reduced")
    ]
    means = printed("precision-2"), printed("precision-reduced")
    noise = Rig().accelerometer_noise * STANDARD_GRAVITY
    table = [
        Row(
            "prior mean of set 2's precision, if it decreases to the posterior of the reduced set",
            f"above {DECREASED_TO:g} 1/N^2",
            "the precision parameter decreases",
            "the posterior mean lies between the prior mean and what the samples say, which is then below "
            f"{means[0]:g} on the full set: white noise of {math.sqrt(8.0 / means[0]) / noise:.3g} kg or "
            "more at nominal peaks",
        ),
        Row(
            "least mass at which one prior gives 11.6 and 32.2, nominal",
            f"{least_mass(noise, (counts[0], counts[1]), means):.3g} kg",
            "not stated",
            "white noise of one scatter in both sets; below it beta would be negative",
        ),
    ]
    for mass in (10.0, 15.0, MASS, 25.0):
        alpha, beta = shape_and_rate_for(mass, noise, (counts[0], counts[1]), means)
        ours, remark = "none: alpha or beta would be negative", ""
        if min(alpha, beta) > 0.0:
            ours = f"alpha {alpha:.3g}, beta {beta:.2g} N^2: worth {2.0 * alpha:.0f} samples"
            remark = (
                f"mean {alpha / beta:.3g}, standard deviation {math.sqrt(alpha) / beta:.2g}; "
                f"alpha/beta^2, the paper's word for it, {alpha / beta**2:.3g} 1/N^2"
            )
        table.append(Row(f"prior for 11.6 and 32.2 at {mass:g} kg, nominal", ours, "a picture", remark))
    return table


def details(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """One line a claim, a column a prior with a name; highest and nominal peaks."""
    return [
        {"claim": claim.name, "paper": claim.paper}
        | {name: _told(dataset.sel(prior=name, claim=claim.name)) for name in NAMED}
        for claim in CLAIMS
    ]


def _told(mine: xr.Dataset) -> str:
    """Value, error and verdict by highest and by nominal peaks."""
    words = {1.0: "yes", -1.0: "**no**", 0.0: "open"}
    shown = []
    for peaks in PEAKS:
        one = mine.sel(peaks=peaks)
        value, error = float(one["value"]), float(one["monte_carlo_error"])
        figure = "< 0.001" if max(abs(value), error) < 1e-3 else with_error(value, error)
        shown.append(f"{figure} {words.get(float(one['verdict']), '')}".strip())
    return " / ".join(shown)


EXPERIMENT = Experiment(
    name="prior_sweep",
    question="which of the paper's claims depend on its prior?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    common_records=True,
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
