"""What depends on what the paper does not state of its numerical example? One choice at a time, section 3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from experiments.against_emcee import CHECKED, SAMPLED, verdict_rows, word
from experiments.against_paper import band
from experiments.closed_forms import measure
from experiments.paper_numbers import printed
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row
from friction_bayes.mechanics.simulate import signal_to_noise_db, simulate
from friction_bayes.mechanics.testbed import PAPER_DURATION, PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["EXPERIMENT", "Config"]

FRICTION = printed("example-friction")
"""True friction of the example [N]."""

METHODS = ("normal-gamma, highest", "normal-gamma, nominal")
VARIABLES = {
    "error": ("1", "(posterior mean - true friction) / true friction"),
    "precision": ("1/N^2", "posterior mean of the precision"),
    "amplitudes": ("1", "amplitudes used"),
    "samples": ("1", "friction samples, n of Eqs. (5) to (8)"),
    **SAMPLED,
}
OF_SIGNAL = {
    "signal_to_noise_db": ("dB", "mean square of the noise-free motion over the variance of the stated noise")
}


@dataclass(frozen=True)
class Choice:
    """What the paper does not state of its example: release [m] and sampling rate [Hz]."""

    release: float = PAPER_RELEASE
    sampling_rate: float = 1000.0


CHOICES = {
    "as chosen: 14.7 mm, 1 kHz": Choice(),
    "release 14.4 mm": Choice(release=0.0144),
    **{f"{rate:g} Hz": Choice(sampling_rate=rate) for rate in (100.0, 200.0, 500.0, 2000.0, 5000.0)},
}


@dataclass(frozen=True)
class Config:
    """Choices, records a choice, how many go through emcee, and the noise that the paper states [m]."""

    choices: tuple[str, ...] = tuple(CHOICES)
    records: int = 200
    records_full: int = 400
    checked: int = CHECKED
    noise_sd: float = printed("example-noise")


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every choice."""
    records = config.records_full if full else config.records
    return [
        {"choice": choice, "replicate": i, "check": i < config.checked}
        for i in range(records)
        for choice in config.choices
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """The paper's procedure by either reading of a peak."""
    choice = CHOICES[cell["choice"]]
    of_noise, of_sampler = seeds_of(cell, seed)
    clean = simulate(
        PAPER_SYSTEM,
        friction=FRICTION,
        initial_displacement=choice.release,
        duration=PAPER_DURATION,
        sampling_rate=choice.sampling_rate,
    )
    noise = np.random.default_rng(of_noise).normal(0.0, config.noise_sd, clean.size)
    record = clean.copy(data=clean.values + noise)
    found = measure(record, PAPER_SYSTEM, FRICTION, methods=METHODS, check=cell["check"], seed=of_sampler)
    moving = clean.values[clean["time"].values < clean.attrs["stop_time"]]
    return {name: found[name] for name in ("method", *VARIABLES)} | {
        "signal_to_noise_db": signal_to_noise_db(moving, config.noise_sd)
    }


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions choice, replicate, method; the ratio of the two precisions along the first two."""
    dims = ("choice", "replicate")
    dataset = lay_out(cells, results, dims=dims, variables=VARIABLES, inner={"method": METHODS})
    highest, nominal = (dataset["precision"].sel({"method": name}, drop=True) for name in METHODS)
    ratio = (highest / nominal).assign_attrs(units="1", long_name="precision by highest peaks over nominal")
    return dataset.merge(lay_out(cells, results, dims=dims, variables=OF_SIGNAL)).assign(
        precision_ratio=ratio
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """Evidence, signal-to-noise ratio, and precision by both readings."""
    table = []
    for choice in dataset["choice"].values.tolist():
        mine = dataset.sel(choice=choice)
        counts = {name: mine[name].isel(method=0).median() for name in ("amplitudes", "samples")}
        table += [
            Row(
                f"{choice}: evidence",
                f"{float(counts['amplitudes']):.0f} amplitudes, {float(counts['samples']):.0f} drops",
                f"{printed('example-amplitudes'):g} amplitudes (evidence)",
            ),
            Row(
                f"{choice}: signal-to-noise ratio",
                f"{float(mine['signal_to_noise_db'].mean()):.2f} dB",
                f"{printed('example-snr'):g} dB",
                "while it moves, at the noise stated",
            ),
        ]
        for method in METHODS:
            one = mine.sel({"method": method})
            table.append(
                Row(
                    f"{choice}: precision, {method}",
                    f"{band(one['precision'])} 1/N^2",
                    f"{printed('example-precision'):g} 1/N^2",
                    f"error {band(one['error'], factor=100.0)} %",
                    word(one),
                )
            )
        ratio = f"{band(mine['precision_ratio'])}"
        table.append(Row(f"{choice}: precision by highest peaks over nominal", ratio, "", "record by record"))
    return table + verdict_rows(dataset)


EXPERIMENT = Experiment(
    name="example_choices",
    question="what depends on what the paper does not state of its numerical example?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("choice",),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
