"""Which method for which record? Closed forms, classical methods and emcee on the same synthetic records.

One thing at a time is varied about a base record: the noise, the sampling rate, the length, and an effect
that no method but Feeny and Liang's (which knows viscous damping) has in its model.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import SAMPLED, sampled, verdict_rows
from experiments.classical import CLASSICAL
from experiments.closed_forms import METHODS, against_truth, posterior_against_truth
from experiments.method_tables import detail_lines, summarised, summary_rows
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import SweepConfig, lay_out, seeds_of, sweep_cells
from experiments.tables import Row
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["EXPERIMENT", "LABELS", "Config", "conditions"]

EMCEE = "emcee"
LABELS = (*METHODS, *CLASSICAL, EMCEE)
"""Methods by the label of tables and figures."""

VARIABLES: dict[str, tuple[str, str]] = {
    "friction": ("N", "estimate of the friction"),
    "sd": ("N", "its standard deviation or standard error"),
    "low": ("N", "lower end of the 90 % interval"),
    "high": ("N", "upper end of the 90 % interval"),
    "error": ("1", "(estimate - true friction) / true friction"),
    "covers": ("1", "whether the 90 % interval covers the true friction"),
    "width": ("1", "width of the 90 % interval over the true friction"),
    "elapsed": ("s", "wall time from record to interval"),
    "refused": ("1", "whether the record was refused"),
    **SAMPLED,
}


@dataclass(frozen=True)
class Config(SweepConfig):
    """The base record, what is varied about it, and the effects: parameters by name and effect.

    Each effect is as large as a careful experimenter might overlook: viscous damping and drag that at first
    take a third of what friction takes, a rest position off by two noise standard deviations, and so on.
    """

    friction: float = PAPER_FRICTION
    initial_displacement: float = PAPER_RELEASE
    duration: float = 33.0
    sampling_rate: float = 200.0
    noise_sd: float = 5e-4
    noise_levels: tuple[float, ...] = (5e-5, 1.6e-4, 5e-4, 1.6e-3, 5e-3)
    rates: tuple[float, ...] = (1000.0, 200.0, 50.0, 20.0, 10.0)
    lengths: tuple[float, ...] = (33.0, 16.0, 8.0, 4.0, 2.0)
    effects: dict[str, dict[str, float]] = field(
        default_factory=lambda: {
            "none": {},
            "viscous damping": {"viscous_damping.damping_ratio": 1e-3},
            "quadratic drag": {"quadratic_drag.drag_coefficient": 1.6},
            "friction drift": {"friction_drift.relative_change": 0.5},
            "Stribeck friction": {
                "stribeck_friction.static_excess": 0.5,
                "stribeck_friction.stribeck_velocity": 0.02,
            },
            "asymmetric friction": {"asymmetric_friction.asymmetry": 0.3},
            "cubic stiffness": {"cubic_stiffness.cubic_stiffness": 2e5},
            "sensor offset": {"sensor_offset.offset": 1e-3},
            "sensor drift": {"sensor_drift.offset": 0.0, "sensor_drift.rate": 5e-5},
            "interference": {
                "periodic_interference.amplitude": 5e-4,
                "periodic_interference.frequency": 7.0,
                "periodic_interference.phase": 1.0,
            },
            "outliers": {"outliers.fraction": 0.02, "outliers.scale": 5e-3},
        }
    )


def conditions(config: Config) -> dict[str, dict[str, Any]]:
    """Return what each condition, named by its question and level, changes of the base record."""
    noise = {f"noise: {1e3 * value:g} mm": {"noise_sd": value} for value in config.noise_levels}
    rates = {f"sampling rate: {value:g} Hz": {"sampling_rate": value} for value in config.rates}
    lengths = {f"record length: {value:g} s": {"duration": value} for value in config.lengths}
    effects = {f"effect: {name}": {"effects": effect} for name, effect in config.effects.items()}
    return {**noise, **rates, **lengths, **effects}


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every condition."""
    return sweep_cells({"condition": list(conditions(config))}, config, full, of_paper=lambda known: False)


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """All methods on one record; emcee where the cell's ``check`` is set."""
    of_noise, of_sampler = seeds_of(cell, seed)
    base = {
        name: getattr(config, name)
        for name in ("friction", "initial_displacement", "duration", "sampling_rate", "noise_sd")
    }
    settings = base | conditions(config)[cell["condition"]]
    record = fb.simulate(PAPER_SYSTEM, seed=of_noise, **settings)
    truth = config.friction
    by_label: dict[str, Callable[[xr.DataArray], dict[str, float]]] = {}
    for label, (method, peaks) in METHODS.items():
        by_label[label] = partial(_closed_form, method=method, peaks=peaks, truth=truth)
    for label in CLASSICAL:
        by_label[label] = partial(_classical, label=label, truth=truth)
    if cell["check"]:
        by_label[EMCEE] = partial(_sampled, seed=of_sampler, truth=truth)
    columns: dict[str, list[float]] = {name: [] for name in VARIABLES}
    for label in LABELS:
        found = _figures(by_label[label], record) if label in by_label else {}
        for name, column in columns.items():
            column.append(found.get(name, math.nan))
    return {**columns}


def _figures(method: Callable[[xr.DataArray], dict[str, float]], record: xr.DataArray) -> dict[str, float]:
    """The figures of one method on a record; a refusal where it cannot estimate."""
    with warnings.catch_warnings():
        # what a method is not sure of shows in its figures here
        warnings.simplefilter("ignore")
        began = perf_counter()
        try:
            found = method(record)
        except fb.InputError:
            return {"refused": 1.0}
        elapsed = perf_counter() - began
    return found | {"elapsed": elapsed, "refused": 0.0}


def _closed_form(record: xr.DataArray, *, method: str, peaks: str, truth: float) -> dict[str, float]:
    estimate = fb.estimate(record, PAPER_SYSTEM, method=method, peaks=peaks, random_force="none")
    return posterior_against_truth(estimate.friction, truth)


def _classical(record: xr.DataArray, *, label: str, truth: float) -> dict[str, float]:
    found = CLASSICAL[label](find_free_decay(record, PAPER_SYSTEM))
    return against_truth(found.friction, found.sd, *found.interval(0.9), truth)


def _sampled(record: xr.DataArray, *, seed: int, truth: float) -> dict[str, float]:
    """Draws of the posterior that ``waveform`` approximates: every parameter of the whole signal."""
    found = sampled(fb.estimate(record, PAPER_SYSTEM, random_force="none"), seed=seed)
    names = ("reference_mean", "reference_sd", "reference_low", "reference_high")
    return found | against_truth(*(found[name] for name in names), truth)


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions condition, replicate, method; question and level of each condition; what records come to."""
    dataset = lay_out(
        cells, results, dims=("condition", "replicate"), variables=VARIABLES, inner={"method": LABELS}
    )
    named = [name.split(": ", 1) for name in dataset["condition"].values.tolist()]
    return summarised(dataset).assign_coords(
        question=("condition", [question for question, _ in named]),
        level=("condition", [level for _, level in named]),
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """A row a condition, and emcee's results for ``waveform``."""
    verdict = verdict_rows(dataset.sel({"method": [EMCEE]}))
    return summary_rows(dataset) + [replace(row, what="agrees with emcee: waveform") for row in verdict]


EXPERIMENT = Experiment(
    name="method_comparison",
    question="which method for which record?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="normal-gamma, highest",
    details=detail_lines,
    paired=("condition",),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
