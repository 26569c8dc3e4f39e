"""What does a force that fluctuates do to the paper's estimator, its precision criterion and its intervals?

An Ornstein-Uhlenbeck force added to dry friction, as measured decays show it, on the example of section 3;
and the friction of the testbed, which varies and departs from Coulomb's law in the bursts of Fig. 6.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled, three_columns, verdict_rows, word
from experiments.blind.ornstein_uhlenbeck import ornstein_uhlenbeck
from experiments.closed_forms import AGAINST_TRUTH, posterior_against_truth
from experiments.method_tables import share_error, size_of_error, with_error
from experiments.paper_numbers import printed
from experiments.reduced_data_set import DATA_SETS
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row
from experiments.varying_friction import varying_friction_decay
from friction_bayes.core.system import Oscillator
from friction_bayes.mechanics.testbed import PAPER_RELEASE, PAPER_SYSTEM
from friction_bayes.records.record import make_record

__all__ = ["EXPERIMENT", "METHODS", "Config", "example_with_force"]

METHODS: dict[str, dict[str, str]] = {
    "normal-gamma, highest": {"method": "normal-gamma", "peaks": "highest"},
    "normal-gamma, nominal": {"method": "normal-gamma", "peaks": "nominal"},
    "waveform, white noise alone": {"method": "waveform", "random_force": "none"},
    "waveform, random force": {"method": "waveform", "random_force": "auto"},
}
"""Options of the estimate by the label of the tables."""

VARIABLES = AGAINST_TRUTH | {
    "precision": ("1/N^2", "posterior mean of the precision; of normal-gamma"),
    "accepted": ("1", "accepted relative to a set-up record without the force; of normal-gamma"),
    "probability": ("1", "probability of a random force; of waveform with one"),
    "force_sd": ("1", "its standard deviation over the friction, given that there is one"),
    **SAMPLED,
}

TESTBED: dict[str, dict[str, Any]] = {
    "testbed, friction constant": {"roughness": 0.0, "burst_sizes": (0.0, 0.0, 0.0)},
    "testbed, bursts alone": {"roughness": 0.0},
    "testbed, as chosen": {},
}
"""Data set 2 without and with the departures that the paper's load cell shows."""


@dataclass(frozen=True)
class Config:
    """Sizes of the force over the friction, correlation times [s], noise of a sample [m], and records.

    The first ``checked`` of a condition go through emcee; with a random force, where one takes it 20 s of
    processor time, the first ``checked_forced``, and all ``checked`` with ``--full``.
    """

    sizes: tuple[float, ...] = (0.0, 0.05, 0.1, 0.2, 0.4, 0.6)
    correlation_time: float = 0.1
    other_times: tuple[float, ...] = (0.02, 0.5)
    size_at_others: float = 0.2
    noise: tuple[float, ...] = (printed("example-noise"), 0.1 * printed("example-noise"))
    sampling_rate: float = 1000.0
    rig: Rig = field(default_factory=Rig)
    testbed: tuple[str, ...] = tuple(TESTBED)
    records: int = 20
    records_full: int = 400
    checked: int = CHECKED
    checked_forced: int = 3


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every force and noise on the example, and every friction of the testbed."""
    forces = [(noise, size, config.correlation_time) for noise in config.noise for size in config.sizes]
    forces += [(config.noise[0], config.size_at_others, time) for time in config.other_times]
    conditions = [
        {"condition": _name(*force), "noise": force[0], "size": force[1], "time": force[2]}
        for force in forces
    ]
    conditions += [{"condition": name} for name in config.testbed]
    records = config.records_full if full else config.records
    forced = config.checked if full else config.checked_forced
    return [
        condition | {"replicate": i, "check": i < config.checked, "check_forced": i < forced}
        for i in range(records)
        for condition in conditions
    ]


def _name(noise: float, size: float, time: float) -> str:
    if size == 0.0:
        return f"example, noise {noise:.0e} m, no force"
    return f"example, noise {noise:.0e} m, force {100.0 * size:.0f} % over {time:g} s"


def example_with_force(
    seed: int, *, size: float, correlation_time: float, noise_sd: float, sampling_rate: float
) -> xr.DataArray:
    """The example of section 3 with an Ornstein-Uhlenbeck force on the mass until it comes to rest.

    Parameters
    ----------
    seed : int
        Of force and noise.
    size : float
        Standard deviation of the force over the friction.
    correlation_time : float
        [s].
    noise_sd : float
        Of the sensor [m].
    sampling_rate : float
        [Hz].
    """
    rng = np.random.default_rng(seed)
    friction = printed("example-friction")
    time = np.arange(round(33.0 * sampling_rate)) / sampling_rate
    # drawn first: without a force it is the example's own record
    noise = noise_sd * rng.standard_normal(time.size)
    force = ornstein_uhlenbeck(rng, size * friction, correlation_time, 1.0 / sampling_rate, time.size)
    level = np.full(time.size, friction)
    motion, _ = varying_friction_decay(PAPER_SYSTEM, level, PAPER_RELEASE, 0.0, time, external_force=force)
    return make_record(
        time,
        motion.displacement + noise,
        "displacement",
        name="example with a random force (synthetic)",
        synthetic=True,
    )


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """The same force and noise at every size; a set-up record of its own noise without the force."""
    of_record, of_set_up = seed.generate_state(2).tolist()
    _, of_sampler = seeds_of(cell, seed)
    if "size" in cell:
        system, truth = PAPER_SYSTEM, printed("example-friction")
        settings = {
            "correlation_time": cell["time"],
            "noise_sd": cell["noise"],
            "sampling_rate": config.sampling_rate,
        }
        record = example_with_force(of_record, size=cell["size"], **settings)
        set_up = example_with_force(of_set_up, size=0.0, **settings)
    else:
        rig = replace(config.rig, **TESTBED[cell["condition"]])
        still = replace(config.rig, **TESTBED["testbed, friction constant"])
        signals = run_rig(rig, DATA_SETS["2"], seed=of_record)
        system, truth, record = system_of(rig), true_friction(signals), signals["acceleration"]
        set_up = run_rig(still, DATA_SETS["2"], seed=of_set_up)["acceleration"]
    columns: dict[str, list[float]] = {name: [] for name in VARIABLES}
    for options in METHODS.values():
        check = cell["check_forced" if options.get("random_force") == "auto" else "check"]
        found = _figures(record, system, truth, options, set_up, of_sampler if check else None)
        for name, column in columns.items():
            column.append(found.get(name, math.nan))
    return {"method": list(METHODS), **columns}


def _figures(
    record: xr.DataArray,
    system: Oscillator,
    truth: float,
    options: Mapping[str, str],
    set_up: xr.DataArray,
    seed: int | None,
) -> dict[str, float]:
    of_paper = options["method"] == "normal-gamma"
    with warnings.catch_warnings():
        # a force that moves the frequency or leaves little friction is what is studied
        warnings.simplefilter("ignore", fb.RecordWarning)
        try:
            estimate = fb.estimate(record, system, setup=set_up if of_paper else None, **options)
        except fb.InputError:
            return {}
    found = posterior_against_truth(estimate.friction, truth)
    if seed is not None:
        found |= sampled(estimate, seed=seed)
    if of_paper:
        return found | {
            "precision": float(estimate.precision.mean()),
            "accepted": float(estimate.acceptance.accepted),
        }
    force = estimate.fit.random_force
    if options["random_force"] == "auto":
        found["probability"] = 0.0 if force is None else force.probability
        found["force_sd"] = 0.0 if force is None else force.share_of_friction
    return found


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions condition, replicate, method; size, correlation time and noise of each condition."""
    inner = {"method": results[0]["method"]}
    dataset = lay_out(cells, results, dims=("condition", "replicate"), variables=VARIABLES, inner=inner)
    known = {cell["condition"]: cell for cell in cells}
    names = dataset["condition"].values.tolist()
    return dataset.assign_coords(
        size=("condition", [known[name].get("size", math.nan) for name in names], {"units": "1"}),
        time=("condition", [known[name].get("time", math.nan) for name in names], {"units": "s"}),
        noise=("condition", [known[name].get("noise", math.nan) for name in names], {"units": "m"}),
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """The whole-signal fit with a random force, and the paper's procedure; the criterion, and the force."""
    table = [_row(dataset.sel(condition=name), name) for name in dataset["condition"].values.tolist()]
    return table + verdict_rows(dataset)


def _row(mine: xr.Dataset, condition: str) -> Row:
    by_force = mine.sel({"method": "waveform, random force"})
    by_paper = [mine.sel({"method": f"normal-gamma, {peaks}"}) for peaks in ("highest", "nominal")]
    precision = " / ".join(f"{float(each['precision'].median()):.3g}" for each in by_paper)
    accepted = " / ".join(_percent(share_error(each["accepted"])) for each in by_paper)
    return Row(
        condition,
        _figures_of(by_force),
        _figures_of(by_paper[0]),
        f"precision {precision} 1/N^2, accepted {accepted} (highest / nominal); probability of a force "
        f"{float(by_force['probability'].median()):.2f}, "
        f"its sd {100.0 * float(by_force['force_sd'].median()):.2g} % of friction",
        word(by_force),
    )


def _figures_of(mine: xr.Dataset) -> str:
    """RMS error, coverage and width of the 90 % interval, over the friction."""
    return (
        f"{_percent(size_of_error(mine['error']))}, covers {_percent(share_error(mine['covers']))}, "
        f"width {100.0 * float(mine['width'].median()):.2g} %"
    )


def _percent(pair: tuple[float, float]) -> str:
    return f"{with_error(100.0 * pair[0], 100.0 * pair[1])} %"


def details(dataset: xr.Dataset) -> list[Mapping[str, str]]:
    """RMS error, coverage and width by every method, and emcee's results for all four."""
    return [
        {"condition": name}
        | {method: _figures_of(dataset.sel(condition=name).sel({"method": method})) for method in METHODS}
        | three_columns(dataset.sel(condition=name))
        for name in dataset["condition"].values.tolist()
    ]


EXPERIMENT = Experiment(
    name="random_force_verdict",
    question="what does a force that fluctuates do to the paper's estimate, criterion and intervals?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    details=details,
    heading="normal-gamma, highest",
    paired=("condition", "noise", "size", "time"),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
