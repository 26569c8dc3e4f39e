"""How well does monitoring follow machines that wear? Both ways of updating, and the remaining life.

Synthetic machines wear by laws that the wear model knows (a line, a line with diffusion, with scatter from
run to run, with both) and laws that it does not (accelerating, one jump, none at all). Each detection point
is a record; each machine is followed to Tn and then on to the threshold, where its true remaining life ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.method_tables import share_error, size_of_error, with_error
from experiments.runner import Cell, Experiment, Row, main
from experiments.sweeps import lay_out
from friction_bayes.core.arrays import Array
from friction_bayes.mechanics.testbed import PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["EXPERIMENT", "LAWS", "Config", "Machine", "follow_machine"]


VARIABLES: dict[str, tuple[str, str]] = {
    "true_life": ("h", "time from Tn till the friction first reaches the threshold; infinite: never"),
    "life_low": ("h", "5 % quantile of the remaining life"),
    "life_median": ("h", "its median"),
    "life_high": ("h", "its 95 % quantile; infinite where that is beyond all time"),
    "life_covers": ("1", "whether the 90 % interval covers the true remaining life"),
    "life_pit": ("1", "distribution function at the true remaining life, spread over its atoms"),
    "never": ("1", "probability that the threshold is never reached"),
    "forgetting_error": ("1", "(mean of f(r|Tn) - friction of the last record) / friction"),
    "forgetting_covers": ("1", "whether its 90 % interval covers the friction of the last record"),
    "plain_error": ("1", "the same where nothing is forgotten"),
    "plain_covers": ("1", "the same where nothing is forgotten"),
    "discount": ("1", "discount chosen by the one-step forecasts"),
}


@dataclass(frozen=True)
class Config:
    """Machines, their wear and their records.

    Friction begins at 0.07 N and is about 0.11 N after 400 h, at Tn; the machine fails at 0.15 N.
    """

    records: int = 60
    records_full: int = 500
    points: tuple[int, ...] = (4, 8, 16)
    laws: tuple[str, ...] = ("line", "diffusion", "scatter", "both", "accelerating", "jump", "constant")
    start: float = 0.07
    threshold: float = 0.15
    span: float = 400.0
    drift: float = 1e-4
    drift_spread: float = 0.3
    wander: float = 4e-4
    scatter: float = 3e-3
    initial_displacement: float = PAPER_RELEASE
    duration: float = 10.0
    sampling_rate: float = 100.0
    noise_sd: float = 5e-4


@dataclass(frozen=True)
class Machine:
    """A path of wear: friction at the points, what each record shows, and the life that then remains."""

    friction: Array
    shown: Array
    life: float


def _line(config: Config, times: Array, rng: np.random.Generator, wander: float, scatter: float) -> Machine:
    drift = config.drift * math.exp(config.drift_spread * rng.standard_normal())
    steps = np.diff(times)
    moved = drift * steps + wander * np.sqrt(steps) * rng.standard_normal(steps.size)
    friction = config.start + np.concatenate([[0.0], np.cumsum(moved)])
    left = config.threshold - friction[-1]
    # the first passage of a Wiener process with drift is inverse Gaussian
    life = left / drift
    if left > 0.0 and wander > 0.0:
        life = float(rng.wald(left / drift, (left / wander) ** 2))
    return Machine(friction, friction + scatter * rng.standard_normal(times.size), max(life, 0.0))


def _accelerating(config: Config, times: Array, rng: np.random.Generator) -> Machine:
    gained = config.drift * config.span * math.exp(config.drift_spread * rng.standard_normal())
    rate = math.log1p(gained / config.start) / config.span
    friction = config.start * np.exp(rate * times)
    return Machine(friction, friction, max(math.log(config.threshold / friction[-1]) / rate, 0.0))


def _jump(config: Config, times: Array, rng: np.random.Generator) -> Machine:
    moment = rng.uniform(0.3, 0.7) * config.span
    friction = config.start + config.drift * config.span * (times > moment)
    return Machine(friction, friction, math.inf)


LAWS: dict[str, Callable[[Config, Array, np.random.Generator], Machine]] = {
    "line": lambda config, times, rng: _line(config, times, rng, 0.0, 0.0),
    "diffusion": lambda config, times, rng: _line(config, times, rng, config.wander, 0.0),
    "scatter": lambda config, times, rng: _line(config, times, rng, 0.0, config.scatter),
    "both": lambda config, times, rng: _line(config, times, rng, config.wander, config.scatter),
    "accelerating": _accelerating,
    "jump": _jump,
    "constant": lambda config, times, rng: Machine(
        np.full(times.size, config.start), np.full(times.size, config.start), math.inf
    ),
}


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every law and number of points."""
    return [
        {"law": law, "points": points, "replicate": replicate}
        for replicate in range(config.records_full if full else config.records)
        for law in config.laws
        for points in config.points
    ]


def follow_machine(
    config: Config, law: str, points: int, rng: np.random.Generator
) -> tuple[Machine, list[xr.DataArray], fb.MonitorReport]:
    """Wear a machine by a law, record it at evenly spaced points, and monitor it."""
    times = np.linspace(0.0, config.span, points)
    machine = LAWS[law](config, times, rng)
    records = [
        fb.simulate(
            PAPER_SYSTEM,
            friction=float(friction),
            initial_displacement=config.initial_displacement,
            duration=config.duration,
            sampling_rate=config.sampling_rate,
            noise_sd=config.noise_sd,
            seed=int(rng.integers(2**32)),
        )
        for friction in machine.shown
    ]
    report = fb.monitor_records(
        records, PAPER_SYSTEM, threshold=config.threshold, times=times.tolist(), time_unit="h"
    )
    return machine, records, report


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Wear one machine, record it at its points, monitor it, and wait for its end."""
    rng = np.random.default_rng(seed)
    machine, _, report = follow_machine(config, cell["law"], cell["points"], rng)
    life = report.life
    assert life is not None
    low, middle, high = (life.ppf(q) for q in (0.05, 0.5, 0.95))
    within = float(rng.random())
    if math.isinf(machine.life):
        pit = 1.0 - within * life.never
    else:
        pit = within * life.already if machine.life == 0.0 else float(life.cdf(machine.life))
    found = {
        "true_life": machine.life,
        "life_low": low,
        "life_median": middle,
        "life_high": high,
        "life_covers": float(low <= machine.life <= high),
        "life_pit": pit,
        "never": life.never,
        "discount": report.forgetting.discount,
    }
    for name, forgetting in (("forgetting", True), ("plain", False)):
        density = report.density(-1, forgetting=forgetting)
        shown = float(machine.shown[-1])
        found[f"{name}_error"] = float(density.mean()) / shown - 1.0
        found[f"{name}_covers"] = float(density.ppf(0.05) <= shown <= density.ppf(0.95))
    return found


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions law, points, replicate; infinite times, which JSON has not, are put back."""
    dataset = lay_out(cells, results, dims=("law", "points", "replicate"), variables=VARIABLES)
    times = ("true_life", "life_low", "life_median", "life_high")
    return dataset.assign({name: dataset[name].fillna(math.inf) for name in times})


def _percent(pair: tuple[float, float]) -> str:
    return f"{with_error(100.0 * pair[0], 100.0 * pair[1])} %"


def rows(dataset: xr.Dataset) -> list[Row]:
    """One row a law and number of points: forgetting, nothing forgotten, remaining life."""
    table = []
    for law in dataset["law"].values.tolist():
        for points in dataset["points"].values.tolist():
            one = dataset.sel(law=law, points=points)
            ours, plain = (
                f"{_percent(size_of_error(one[f'{name}_error']))}, "
                f"covers {_percent(share_error(one[f'{name}_covers']))}"
                for name in ("forgetting", "plain")
            )
            remark = f"life: 90 % interval covers {_percent(share_error(one['life_covers']))}"
            if np.isfinite(one["true_life"]).all():
                off = one["life_median"] / one["true_life"].clip(min=1.0)
                remark += f", median {float(off.median()):.2f} of the truth"
            else:
                remark += f", never reached with probability {float(one['never'].median()):.2f}"
            table.append(Row(f"{law}, {points} points", ours, plain, remark))
    return table


EXPERIMENT = Experiment(
    name="monitoring",
    question="how well does monitoring follow machines that wear?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="nothing forgotten",
)

if __name__ == "__main__":
    main(EXPERIMENT)
