"""What depends on what the paper does not state of its testbed? One choice at a time, section 4."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled, verdict_rows, word
from experiments.against_paper import band
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS, last_begins, last_part
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row

__all__ = ["DRAWN_PRIOR", "EXPERIMENT", "Config"]

DRAWN_PRIOR = {"mu": 0.5, "lam": 0.05, "alpha": 1.0, "beta": 0.02}
"""A prior that can be drawn with its posterior, as in the paper's figures: wide, and centred far from the
friction [N]; worth a twentieth of a friction sample. The default prior is a billion times as wide."""

VARIABLES = {
    "friction": ("N", "posterior mean of the friction"),
    "error": ("1", "(posterior mean - mean friction of the run) / mean friction of the run"),
    "precision": ("1/N^2", "posterior mean of the precision"),
    "width": ("1", "width of the 90 % interval over the friction"),
    "amplitudes": ("1", "amplitudes used"),
    **SAMPLED,
}

CHOICES: dict[str, dict[str, Any]] = {
    "as chosen": {},
    "mass 2 kg": {"mass": 2.0},
    "mass 10 kg": {"mass": 10.0, "duration": 26.0},
    "mass 20 kg": {"mass": 20.0, "duration": 52.0},
    "release 8 mm": {"release": 0.008},
    "release 30 mm": {"release": 0.03, "duration": 26.0},
    "friction constant": {"roughness": 0.0, "burst_sizes": (0.0, 0.0, 0.0)},
    "roughness 30 %": {"roughness": 0.3},
    "roughness over 0.2 s": {"roughness_time": 0.2},
    "no bursts": {"burst_sizes": (0.0, 0.0, 0.0)},
    "no phase error": {"phase_error": 0.0},
    "viscous damping 0.03 %": {},
    "viscous damping 0.1 %": {},
    "viscous damping 0.3 %": {},
    "prior as drawn": {},
    "prior ten times as strong": {},
}
PRIORS = {
    "prior as drawn": DRAWN_PRIOR,
    "prior ten times as strong": DRAWN_PRIOR | {"lam": 0.5, "alpha": 10.0},
}


DAMPING = {"viscous damping 0.03 %": 3e-4, "viscous damping 0.1 %": 1e-3, "viscous damping 0.3 %": 3e-3}
"""Damping ratios, in addition to the friction."""


@dataclass(frozen=True)
class Config:
    """The rig as chosen, records a choice, and how many go through emcee."""

    rig: Rig = field(default_factory=Rig)
    choices: tuple[str, ...] = tuple(CHOICES)
    data_sets: tuple[str, ...] = ("1", "2", "2-reduced")
    records: int = 40
    records_full: int = 400
    checked: int = CHECKED
    last_share: float = 0.2
    peaks: tuple[str, ...] = ("highest", "nominal")


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every choice on every data set."""
    return [
        {"choice": choice, "data_set": data_set, "replicate": i, "check": i < config.checked}
        for i in range(config.records_full if full else config.records)
        for choice in config.choices
        for data_set in config.data_sets
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """The same draws of friction and noise under every choice."""
    rig = replace(config.rig, **CHOICES[cell["choice"]])
    of_noise, of_sampler = seeds_of(cell, seed)
    signals = run_rig(
        rig,
        DATA_SETS[cell["data_set"]],
        seed=of_noise,
        damping_ratio=DAMPING.get(cell["choice"], 0.0),
    )
    record, since = signals["acceleration"], 0.0
    if cell["data_set"] == "2-reduced":
        since = last_begins(record, config.last_share)
        record = last_part(record, config.last_share)
    truth = true_friction(signals, since)
    prior = PRIORS.get(cell["choice"])
    columns: dict[str, Any] = {name: [] for name in VARIABLES}
    for peaks in config.peaks:
        found = _figures(record, rig, truth, peaks, prior, of_sampler if cell["check"] else None)
        for name, column in columns.items():
            column.append(found.get(name, math.nan))
    return {"peaks": list(config.peaks), **columns}


def _figures(
    record: xr.DataArray,
    rig: Rig,
    truth: float,
    peaks: str,
    prior: Mapping[str, float] | None,
    seed: int | None,
) -> dict[str, float]:
    """Results of the paper's procedure; empty where the record has fewer than two whole periods.

    ``seed`` is that of the sampler, None where it does not run.
    """
    with warnings.catch_warnings():
        # a frequency read off few noisy periods may differ from the declared one: that is in the error
        warnings.simplefilter("ignore", fb.RecordWarning)
        try:
            estimate = fb.estimate(record, system_of(rig), method="normal-gamma", peaks=peaks, prior=prior)
        except fb.InputError:
            return {}
    mean, (low, high) = float(estimate.friction.mean()), estimate.friction.interval(0.9)
    found = {"friction": mean, "error": mean / truth - 1.0, "amplitudes": float(estimate.amplitudes)}
    if estimate.amplitudes < 3 and prior is None:
        # one friction sample has no scatter, and the default prior none to lend
        return found
    if seed is not None:
        found |= sampled(estimate, seed=seed)
    return found | {"precision": float(estimate.precision.mean()), "width": float(high - low) / truth}


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions choice, data_set, replicate, peaks."""
    inner = {"peaks": results[0]["peaks"]}
    return lay_out(cells, results, dims=("choice", "data_set", "replicate"), variables=VARIABLES, inner=inner)


def rows(dataset: xr.Dataset) -> list[Row]:
    """Error and precision of every choice, and the paper's precision."""
    stated = {"1": "precision-1", "2": "precision-2", "2-reduced": "precision-reduced"}
    table = []
    for data_set in dataset["data_set"].values.tolist():
        for choice in dataset["choice"].values.tolist():
            for peaks in dataset["peaks"].values.tolist():
                mine = dataset.sel(data_set=data_set, choice=choice, peaks=peaks)
                rms = float(np.sqrt((mine["error"] ** 2).mean()))
                refused = int(mine["error"].isnull().sum())
                single = int(mine["precision"].isnull().sum()) - refused
                counts = {"of one sample, which has no precision": single, "refused": refused}
                some = mine["precision"].notnull().any()
                others = "".join(f", {n} {what}" for what, n in counts.items() if n)
                table.append(
                    Row(
                        f"set {data_set}, {choice}, {peaks}",
                        f"precision {band(mine['precision'])} 1/N^2" if some else "no precision",
                        f"{printed(stated[data_set]):g} 1/N^2",
                        f"error {band(mine['error'], factor=100.0)} %, RMS {100.0 * rms:.3g} %; "
                        f"{float(mine['amplitudes'].median()):.0f} amplitudes{others}",
                        word(mine),
                    )
                )
    return table + verdict_rows(dataset, "peaks")


EXPERIMENT = Experiment(
    name="testbed_choices",
    question="what depends on what the paper does not state of its testbed?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("choice", "data_set"),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
