"""How alike are the acquired and the estimated response? Amplitudes, period and the jump of Figs. 7 and 9."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_paper import band
from experiments.reduced_data_set import DATA_SETS
from experiments.rig import Rig, run_rig, system_of
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out
from experiments.tables import Row
from friction_bayes.core.arrays import Array
from friction_bayes.core.quantities import STANDARD_GRAVITY
from friction_bayes.decay.friction_samples import peak_amplitudes

__all__ = ["EXPERIMENT", "Config", "jump_at_turns"]

VARIABLES = {
    "amplitude_difference": (
        "m/s2",
        "RMS difference of the nominal amplitudes, acquired less estimated",
    ),
    "period_difference": ("1", "period found in the record over that of the declared system, less one"),
    "lag": ("1", "how far the record is behind the estimated response when it comes to rest [periods]"),
    "residual": ("1", "RMS difference of the two signals while both move, over the noise of the sensor"),
    "jump": ("1", "jump of the acceleration at a turning point, 2 r/m, over the noise of the sensor"),
    "jump_found": ("1", "mean jump of the acquired signal over all its turning points, over 2 r/m"),
    "jump_clear": ("1", "that mean over its standard error"),
}
REACH = 10
"""Samples to either side of a turning point that a jump is read from."""


@dataclass(frozen=True)
class Config:
    """The rig and its records."""

    rig: Rig = field(default_factory=Rig)
    data_sets: tuple[str, ...] = ("1", "2")
    records: int = 100
    records_full: int = 1000


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Both data sets."""
    records = config.records_full if full else config.records
    return [{"data_set": data_set, "replicate": i} for i in range(records) for data_set in config.data_sets]


def jump_at_turns(acceleration: Array, turns: Array, reach: int) -> tuple[float, float]:
    """Mean jump of an acceleration at its turning points, ``2 r/m`` by Coulomb's law, and its standard error.

    A smooth decay is even about a turning point, so that the means over ``reach`` samples to either side
    differ by the jump alone.

    Parameters
    ----------
    acceleration : ndarray, shape (n,)
    turns : ndarray, shape (k,)
        Turning points [samples], the first at the end of a motion to the negative side.
    reach : int
    """
    jumps = []
    for k, turn in enumerate(turns):
        after, before = math.ceil(turn + 0.5), math.floor(turn - 0.5)
        if before - reach + 1 >= 0 and after + reach <= acceleration.size:
            step = (
                acceleration[after : after + reach].mean()
                - acceleration[before - reach + 1 : before + 1].mean()
            )
            # the motion before the first turn is negative, and friction turns from positive to negative there
            jumps.append(-step if k % 2 == 0 else step)
    found = np.array(jumps)
    return float(found.mean()), float(found.std(ddof=1)) / math.sqrt(found.size)


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """One run, its friction by the paper's procedure, and the response that this means from one release."""
    rig, system = config.rig, system_of(config.rig)
    record = run_rig(rig, DATA_SETS[cell["data_set"]], seed=int(seed.generate_state(1)[0]))["acceleration"]
    estimate = fb.estimate(record, system, method="normal-gamma", peaks="highest")
    friction = float(estimate.friction.mean())
    response = fb.simulate(
        system,
        friction=friction,
        initial_displacement=rig.release,
        duration=rig.duration,
        sampling_rate=rig.sampling_rate,
        quantity="acceleration",
    )
    stop = min(record.attrs["stop_time"], response.attrs["stop_time"])
    moving = record["time"].values < stop
    noise = rig.accelerometer_noise * STANDARD_GRAVITY
    other = fb.estimate(response, system, method="normal-gamma", peaks="highest")
    mine, theirs = (peak_amplitudes(each.decay, "nominal")[1] for each in (estimate, other))
    common = min(mine.size, theirs.size)
    off = estimate.frequency / system.natural_frequency - 1.0
    half = math.pi / system.natural_frequency * rig.sampling_rate
    turns = half * np.arange(1, math.floor(stop * rig.sampling_rate / half))
    found, error = jump_at_turns(record.values, turns, REACH)
    expected = 2.0 * DATA_SETS[cell["data_set"]] / rig.mass
    return {
        "amplitude_difference": float(np.sqrt(np.mean((mine[:common] - theirs[:common]) ** 2))),
        "period_difference": 1.0 / (1.0 + off) - 1.0,
        "lag": -off * stop * system.natural_frequency / (2.0 * math.pi),
        "residual": float(np.sqrt(np.mean((record.values - response.values)[moving] ** 2))) / noise,
        "jump": expected / noise,
        "jump_found": found / expected,
        "jump_clear": found / error,
    }


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions data_set, replicate."""
    return lay_out(cells, results, dims=("data_set", "replicate"), variables=VARIABLES)


def rows(dataset: xr.Dataset) -> list[Row]:
    """The paper's statements about its Figs. 7 and 9, and ours."""
    stated = {
        "amplitude_difference": ("a minor difference between the waveform amplitudes", 1.0, "m/s2"),
        "period_difference": ("and the periods", 100.0, "%"),
        "lag": ("", 1.0, "periods"),
        "residual": ("", 1.0, "of the sensor's noise"),
        "jump": (
            "the discontinuity is hardly observed due to the sensor noise",
            1.0,
            "of the sensor's noise",
        ),
        "jump_found": ("", 1.0, "of 2 r/m"),
        "jump_clear": ("", 1.0, "standard errors"),
    }
    return [
        Row(
            f"set {data_set}: {name.replace('_', ' ')}",
            f"{band(dataset[name].sel(data_set=data_set), factor=factor)} {unit}",
            words,
            dataset[name].attrs["long_name"],
        )
        for data_set in dataset["data_set"].values.tolist()
        for name, (words, factor, unit) in stated.items()
    ]


EXPERIMENT = Experiment(
    name="estimated_response",
    question="how alike are the acquired and the estimated response?",
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
