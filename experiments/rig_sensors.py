"""Do the sensors of the twin give back what went in? Reference, phase error, departures from Coulomb."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_paper import compared
from experiments.paper_numbers import printed
from experiments.rig import Rig, measured_reference, plateaus, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row

__all__ = ["EXPERIMENT", "Config"]

VARIABLES = {
    "reference": ("N", "mean size of the refined force on its plateaus"),
    "true_friction": ("N", "mean friction that the run had"),
    "phase_error": ("deg", "delay of the accelerometer behind the displacement sensor"),
    "displacement_estimate": ("N", "posterior mean by the whole displacement signal"),
}
DEPARTURE = {"burst_time": ("s", "when the refined force departs most from its mean, around each burst")}
SEARCH = 0.1
"""How far from a stated time its departure is looked for [s]."""


@dataclass(frozen=True)
class Config:
    """The rig, and how many runs at each of its two friction levels."""

    rig: Rig = field(default_factory=Rig)
    records: int = 200
    records_full: int = 1000


FRICTIONS = {"1": printed("reference-1"), "2": printed("reference-2")}


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Both data sets."""
    records = config.records_full if full else config.records
    return [{"data_set": name, "replicate": i} for i in range(records) for name in FRICTIONS]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Read one run off its three sensors."""
    rig = config.rig
    signals = run_rig(rig, FRICTIONS[cell["data_set"]], seed=int(seed.generate_state(1)[0]))
    force = signals["friction_force"]
    kept, size = plateaus(rig, force)
    time = force["time"].values[kept]
    reference = measured_reference(rig, force)
    departures = []
    for stated in rig.burst_times:
        near = np.flatnonzero(np.abs(time - stated) < SEARCH)
        largest = near[np.argmax(np.abs(size[near] - reference))] if near.size else None
        departures.append(math.nan if largest is None else float(time[largest]))
    return {
        "reference": reference,
        "true_friction": true_friction(signals),
        "phase_error": _phase_error(signals, rig),
        "displacement_estimate": _by_displacement(signals["displacement"], rig),
        "burst_time": departures,
    }


def _by_displacement(record: xr.DataArray, rig: Rig) -> float:
    try:
        return float(fb.estimate(record, system_of(rig), random_force="none").friction.mean())
    except fb.InputError:
        # equal codes of the digitiser at an extreme may look like the end of its range
        return math.nan


def _phase_error(signals: Mapping[str, xr.DataArray], rig: Rig) -> float:
    """Phase of the displacement's second derivative over the acceleration's, at the natural frequency."""
    acceleration = signals["acceleration"]
    time = acceleration["time"].values
    moving = time < acceleration.attrs["stop_time"]
    time = time[moving] - time[moving][0]
    turn, carrier = 2.0 * math.pi / time[-1], 2.0 * math.pi * rig.natural_frequency
    window = 0.5 * (1.0 - np.cos(turn * time))
    slope, bend = 0.5 * turn * np.sin(turn * time), 0.5 * turn**2 * np.cos(turn * time)
    wave = np.exp(-1j * carrier * time)
    # the second derivative moved over to window and wave, which leave nothing at the ends
    displacement = signals["displacement"].values[moving]
    expected = np.sum((bend - 2j * carrier * slope - carrier**2 * window) * wave * displacement)
    return math.degrees(np.angle(expected / np.sum(window * wave * acceleration.values[moving])))


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions data_set, replicate; ``burst_time`` along ``burst`` too."""
    dims = ("data_set", "replicate")
    bursts = {"burst": range(len(results[0]["burst_time"]))}
    return lay_out(cells, results, dims=dims, variables=VARIABLES).merge(
        lay_out(cells, results, dims=dims, variables=DEPARTURE, inner=bursts)
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """The paper's statements about its sensors, and ours."""
    table = []
    for name, friction in FRICTIONS.items():
        mine = dataset.sel(data_set=name)
        table.append(
            compared(f"set {name}: refined load cell", mine["reference"], friction, unit="N", digits=4)
        )
        table.append(
            compared(
                f"set {name}: whole displacement signal",
                mine["displacement_estimate"],
                friction,
                unit="N",
                digits=4,
            )
        )
        table.append(
            compared(
                f"set {name}: phase error of the accelerometer",
                mine["phase_error"],
                printed("rig-phase-error"),
                unit="deg",
            )
        )
    stated = [printed(f"burst-{time}") for time in ("3.8", "4", "4.5")]
    for burst, time in enumerate(stated[: dataset.sizes["burst"]]):
        found = dataset["burst_time"].sel(data_set="1").isel(burst=burst)
        table.append(compared("set 1: largest departure from Coulomb's law", found, time, unit="s"))
    return table


EXPERIMENT = Experiment(
    name="rig_sensors",
    question="do the sensors of the twin give back what went in?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("data_set",),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
