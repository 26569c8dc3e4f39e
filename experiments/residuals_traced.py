"""Where do the paper's errors come from? Faults of measuring taken away, then put into the model. Table 2."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import CHECKED, SAMPLED, sampled, sampled_pair, verdict_rows, word
from experiments.against_paper import band
from experiments.paper_numbers import printed
from experiments.reduced_data_set import last_begins, last_part
from experiments.rig import Rig, run_rig, system_of, true_friction
from experiments.runner import Cell, Experiment, main
from experiments.sampling_rate_sweep import FRICTION, down_sampled
from experiments.sweeps import lay_out, seeds_of
from experiments.tables import Row
from friction_bayes.core.system import Oscillator
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.decay.half_cycles import half_cycles
from friction_bayes.estimators.priors import default_prior

__all__ = ["EXPERIMENT", "REMEDIES", "WITHOUT", "Config"]

WITHOUT: dict[str, dict[str, Any]] = {
    "as measured": {},
    "without sensor noise": {"accelerometer_noise": 0.0},
    "without friction scatter": {"roughness": 0.0, "burst_sizes": (0.0, 0.0, 0.0)},
    "grid alone": {"accelerometer_noise": 0.0, "roughness": 0.0, "burst_sizes": (0.0, 0.0, 0.0)},
}
"""The paper's procedure (highest samples, normal-gamma on drops) on the same run without a fault."""

REMEDIES = ("as measured", "nominal peaks", "fitted amplitudes", "envelope", "waveform")
"""The same record with ever more of the measuring in the model: no lifted maxima; no coarse grid either; no
telescoping drops either; the whole signal."""

VARIABLES = {
    "error": ("1", "(posterior mean - mean friction of the run) / mean friction of the run"),
    "sd": ("1", "posterior standard deviation over the friction"),
    "width": ("1", "width of the 90 % interval over the friction"),
    "covers": ("1", "whether the 90 % interval covers the mean friction of the run"),
    **SAMPLED,
}
PAPER_ERRORS = {
    1000.0: printed("error-reduced"),
    100.0: printed("error-100"),
    10.0: printed("error-10"),
}
"""Of Table 2 [%], by sampling rate [Hz]."""
NEGLIGIBLE = 0.01
"""Share of the friction that a coarse grid may take before it counts."""


@dataclass(frozen=True)
class Config:
    """The rig, the rates of its reduced data set 2, records, and how many go through emcee."""

    rig: Rig = field(default_factory=Rig)
    keep_every: tuple[int, ...] = (1, 2, 5, 10, 20, 50, 100)
    records: int = 200
    records_full: int = 1000
    checked: int = CHECKED
    last_share: float = 0.2


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every rate of every run."""
    rates = [config.rig.sampling_rate / step for step in config.keep_every]
    records = config.records_full if full else config.records
    return [
        {"sampling_rate": rate, "replicate": i, "check": i < config.checked}
        for i in range(records)
        for rate in rates
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """The paper's procedure without each fault, then the remedies on the record as it is."""
    of_noise, own = seeds_of(cell, seed)
    of_sampler = own if cell["check"] else None
    steps: dict[str, dict[str, float]] = {}
    record = None
    for name, changes in WITHOUT.items():
        rig = replace(config.rig, **changes)
        signals = run_rig(rig, FRICTION, seed=of_noise)
        whole = signals["acceleration"]
        truth = true_friction(signals, last_begins(whole, config.last_share))
        cut = down_sampled(
            last_part(whole, config.last_share), round(rig.sampling_rate / cell["sampling_rate"]), of_noise
        )
        steps[name] = _by_estimator(cut, system_of(rig), truth, "normal-gamma", "highest", of_sampler)
        if not changes:
            record, true_of_record = cut, truth
    assert record is not None
    system = system_of(config.rig)
    known = record, system, true_of_record
    steps["nominal peaks"] = _by_estimator(*known, "normal-gamma", "nominal", of_sampler)
    steps["fitted amplitudes"] = _by_fitted_amplitudes(*known, of_sampler)
    for method in ("envelope", "waveform"):
        steps[method] = _by_estimator(*known, method, "highest", of_sampler)
    columns = {name: [figures.get(name, math.nan) for figures in steps.values()] for name in VARIABLES}
    return {"step": list(steps), **columns}


def _by_estimator(
    record: xr.DataArray, system: Oscillator, truth: float, method: str, peaks: str, seed: int | None
) -> dict[str, float]:
    with warnings.catch_warnings():
        # a frequency read off few samples may differ from the declared one: that is in the error
        warnings.simplefilter("ignore", fb.RecordWarning)
        try:
            estimate = fb.estimate(record, system, method=method, peaks=peaks, random_force="none")
        except fb.InputError:
            return {}
    found = _figures(estimate.friction, truth)
    return found if seed is None else found | sampled(estimate, seed=seed)


def _by_fitted_amplitudes(
    record: xr.DataArray, system: Oscillator, truth: float, seed: int | None
) -> dict[str, float]:
    """The paper's normal-gamma on drops between amplitudes that are local fits instead of single samples."""
    try:
        decay = find_free_decay(record, system)
        drops = half_cycles(decay)["drop"].values
    except fb.InputError:
        return {}
    if drops.size < 2:
        return {}
    # an amplitude falls by 2 u a half cycle
    samples = 0.5 * system.force_factor(decay.quantity) * drops
    prior = fb.NormalGamma(**default_prior("normal-gamma", system, decay.quantity, decay.unit))
    found = _figures(prior.update(samples).friction, truth)
    return found if seed is None else found | sampled_pair(prior, samples, seed=seed)


def _figures(posterior: Any, truth: float) -> dict[str, float]:
    mean, (low, high) = float(posterior.mean()), posterior.interval(0.9)
    return {
        "error": mean / truth - 1.0,
        "sd": float(posterior.std()) / truth,
        "width": float(high - low) / truth,
        "covers": float(low <= truth <= high),
    }


def assemble(cells: Sequence[Cell], results: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """Dimensions sampling_rate, replicate, step; and the rate from which the grid no longer counts."""
    inner = {"step": results[0]["step"]}
    dataset = lay_out(cells, results, dims=("sampling_rate", "replicate"), variables=VARIABLES, inner=inner)
    grid = abs(dataset["error"].sel(step="grid alone", drop=True)).median("replicate")
    rates = dataset["sampling_rate"].values
    fine = [rate for rate in rates if bool((grid.sel(sampling_rate=rates[rates >= rate]) < NEGLIGIBLE).all())]
    frequency = printed("rig-frequency")
    return dataset.assign(
        rate_needed=((), min(fine, default=math.nan) / frequency, {"units": "1"}),
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """Errors without each fault and with each remedy, and how much too wide the intervals are."""
    table = []
    for rate, stated in PAPER_ERRORS.items():
        if rate not in dataset["sampling_rate"]:
            continue
        mine = dataset.sel(sampling_rate=rate)
        table += [
            _row(mine.sel(step=step), f"{rate:g} Hz, {step}", stated) for step in (*WITHOUT, *REMEDIES[1:])
        ]
    table.append(
        Row(
            "sampling rate over frequency from which the grid takes less than 1 %",
            f"{float(dataset['rate_needed']):.3g}",
            f"{printed('rate-over-frequency'):g}",
            "highest samples; fits of the whole signal need none",
        )
    )
    return table + verdict_rows(dataset, "step")


def _row(mine: xr.Dataset, name: str, stated: float) -> Row:
    error = mine["error"].values[np.isfinite(mine["error"].values)]
    if error.size == 0:
        return Row(name, "refused", f"-{stated:g} %", "fewer than two amplitudes can be fitted")
    too_wide = float(mine["sd"].median()) / math.sqrt(float(np.mean(error**2)))
    return Row(
        name,
        f"{band(mine['error'], factor=100.0)} %",
        f"-{stated:g} %",
        f"RMS {_rms(mine['error']):.3g} %; 90 % interval {100.0 * float(mine['width'].median()):.3g} % wide, "
        f"contains the truth in {int(mine['covers'].sum())} of {error.size}; its sd is {too_wide:.2g} times "
        "the RMS error",
        word(mine),
    )


def _rms(values: xr.DataArray) -> float:
    return 100.0 * float(np.sqrt((values**2).mean()))


EXPERIMENT = Experiment(
    name="residuals_traced",
    question="where do the paper's errors come from?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    paired=("sampling_rate",),
    common_records=True,
)

if __name__ == "__main__":
    main(EXPERIMENT)
