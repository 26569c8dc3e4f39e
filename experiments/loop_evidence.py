"""Are the loop's evidences right? Laplace's approximation against bridge sampling, on straining cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.runner import Cell, Experiment, main
from experiments.simulation.bridge import bridged_log_evidence
from experiments.simulation.fit import LoopFit
from experiments.simulation.laplace_evidence import log_evidence
from experiments.simulation.simulated_fit import simulated_fit
from experiments.tables import Row
from friction_bayes.loop.data.prepared_record import cut_records

__all__ = ["CASES", "EXPERIMENT", "fit_of_case"]

SYSTEM = fb.Oscillator(mass=10.0, stiffness=1000.0)

CASES: dict[str, tuple[dict[str, float], tuple[str, ...], dict[str, Any]]] = {
    "Coulomb alone": ({}, (), {}),
    "a damping that is not there: null at the bound": ({}, ("viscous_damping",), {}),
    "two dampings that are not there": ({}, ("viscous_damping", "quadratic_drag"), {}),
    "a Stribeck term that is not there: a shape without a size": ({}, ("stribeck_friction",), {}),
    "viscous damping": ({"viscous_damping.damping_ratio": 0.002}, ("viscous_damping",), {}),
    "its imitation by drift": ({"viscous_damping.damping_ratio": 0.002}, ("friction_drift",), {}),
    "both at once, a ridge": (
        {"viscous_damping.damping_ratio": 0.002},
        ("viscous_damping", "friction_drift"),
        {},
    ),
    "Stribeck": (
        {"stribeck_friction.static_excess": 0.8, "stribeck_friction.stribeck_velocity": 0.1},
        ("stribeck_friction",),
        {},
    ),
    "asymmetry, the signal of an offset": (
        {"sensor_offset.offset": 5e-4},
        ("asymmetric_friction",),
        {},
    ),
    "a line": (
        {"periodic_interference.amplitude": 5e-4, "periodic_interference.frequency": 3.7},
        ("periodic_interference",),
        {},
    ),
    "clipped": ({"sensor_clipping.level": 0.035}, ("sensor_clipping",), {}),
    "comes to rest": ({}, ("viscous_damping",), {"duration": 20.0, "friction": 0.6}),
    "acceleration": (
        {"quadratic_drag.drag_coefficient": 1.0},
        ("quadratic_drag",),
        {"quantity": "acceleration", "noise_sd": 0.05},
    ),
}
"""Name: effects at work, effects fitted, changed settings of the record."""


@dataclass(frozen=True)
class Config:
    """One record a case: twenty periods at sixty samples each, 34 dB."""

    friction: float = 0.25
    initial_displacement: float = 0.05
    duration: float = 12.0
    sampling_rate: float = 60.0
    noise_sd: float = 5e-4
    steps: int = 600
    steps_full: int = 3000


def fit_of_case(name: str, config: Config, seed: int) -> LoopFit:
    """Simulate a case and fit its effects."""
    effects, fitted, changed = CASES[name]
    settings = {
        "friction": config.friction,
        "initial_displacement": config.initial_displacement,
        "duration": config.duration,
        "sampling_rate": config.sampling_rate,
        "noise_sd": config.noise_sd,
    } | changed
    record = fb.simulate(SYSTEM, seed=seed, effects=effects, **settings)
    (segment,) = cut_records([record], SYSTEM)
    return simulated_fit(segment, SYSTEM, fitted, effects)


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a case."""
    steps = config.steps_full if full else config.steps
    return [{"case": name, "steps": steps} for name in CASES]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Both evidences of a case."""
    of_record, of_sampler = (int(s) for s in seed.generate_state(2))
    fit = fit_of_case(cell["case"], config, of_record)
    bridged = bridged_log_evidence(fit, of_sampler, steps=cell["steps"])
    return {"laplace": log_evidence(fit), "bridge": bridged.value, "error": bridged.error}


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a case."""
    columns = {name: ("case", [r[name] for r in results]) for name in results[0]}
    return xr.Dataset(columns, coords={"case": [str(c["case"]) for c in cells]})


def rows(dataset: xr.Dataset) -> list[Row]:
    """Laplace minus bridge, case by case."""
    return [
        Row(
            str(case.item()),
            f"{float(entry['laplace'] - entry['bridge']):+.2f}",
            f"± {entry['error'].item():.2f}",
            "+".join(CASES[str(case.item())][1]) or "none",
        )
        for case, entry in ((c, dataset.sel(case=c)) for c in dataset["case"])
    ]


EXPERIMENT = Experiment(
    name="loop_evidence",
    question="are the loop's evidences right, against bridge sampling?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="Monte Carlo error",
    group="own",
)

if __name__ == "__main__":
    main(EXPERIMENT)
