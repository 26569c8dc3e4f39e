"""What do the closed forms say of every measured record, does emcee agree, and what is left over?"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.closed_forms import closed_form_seconds
from experiments.runner import Cell, Experiment, main
from experiments.tables import Row
from friction_bayes.core.arrays import Array
from friction_bayes.decay.half_cycles import half_cycles
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.mechanics.pendulum import sine_integral
from friction_bayes.records.datasets import dataset_record, list_datasets
from friction_bayes.reference.checking import check_estimate

__all__ = ["EXPERIMENT", "Config"]

SERIES = ("time", "signal", "fit", "residual")
NUMBERS = {
    "friction": "posterior mean",
    "low": "lower end of the 90 % interval",
    "high": "upper end of the 90 % interval",
    "reference_mean": "mean of the draws",
    "reference_low": "5 % quantile of the draws",
    "reference_high": "95 % quantile of the draws",
    "rhat": "nested R-hat over the ensembles",
    "ess_bulk": "bulk effective sample size",
    "ess_tail": "tail effective sample size",
    "agrees": "verdict on closed form against draws, at a false-alarm rate of 1 %; nan where not judged",
    "closed_form_s": "wall time of the closed form [s]",
    "sampler_s": "wall time of the sampler [s]",
    "frequency_ratio": "frequency found over the declared sqrt(k/m)",
    "residual_sd": "standard deviation of signal less fit, over half the signal's span",
    "lag1": "correlation of successive residuals",
    "ljung_box": "Ljung-Box statistic of the residuals over its 99.9 % quantile for white noise",
    "drop_early": "loss of amplitude (sine integral of a pendulum's angle) a half cycle, first third",
    "drop_late": "the same over the last third",
    "half_cycles": "half cycles between fitted turning points",
}
TEXTS = ("record", "method", "unit", "signal_unit", "quantity", "refused", "because")


@dataclass(frozen=True)
class Config:
    """Which estimators look at the records, and how much of a record is kept for its figure."""

    methods: tuple[str, ...] = ("waveform", "envelope")
    points: int = 1500


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every part of every registered set by every method; ``full`` changes nothing."""
    del full
    names = [f"{data_set.name}/{part}" for data_set in list_datasets() for part in data_set.parts]
    return [{"record": name, "method": method} for name in names for method in config.methods]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Estimate with the system that the set declares, check, and keep what the figure needs."""
    texts = dict.fromkeys(TEXTS, "") | dict(cell)
    numbers: dict[str, Any] = dict.fromkeys(NUMBERS)
    series: dict[str, list[float]] = {name: [] for name in SERIES}
    with warnings.catch_warnings():
        # what is warned of, a frequency or a sampler that did not converge, stands in the numbers
        warnings.simplefilter("ignore")
        try:
            record, system = dataset_record(cell["record"])
            estimate = fb.estimate(record, system, method=cell["method"], random_force="none")
        except fb.InputError as error:
            return {**texts, **numbers, **series, "refused": str(error)}
        summary = check_estimate(estimate, seed=int(seed.generate_state(1)[0])).summary
    decay, fit = estimate.decay, estimate.fit
    assert fit.prediction is not None
    residual = decay.values - fit.prediction
    numbers |= _friction(estimate) | _reference(summary) | _losses(decay)
    numbers["closed_form_s"] = closed_form_seconds(record, system, method=cell["method"])
    test = whiteness(residual)
    numbers |= {
        "frequency_ratio": estimate.frequency / system.natural_frequency,
        "residual_sd": float(residual.std() / (0.5 * np.ptp(decay.values))),
        "lag1": test.lag1,
        "ljung_box": test.statistic / test.limit,
    }
    texts |= {
        "unit": estimate.friction_unit,
        "signal_unit": decay.unit,
        "quantity": decay.quantity.name,
        "because": summary["because"],
    }
    stride = math.ceil(decay.values.size / config.points)
    kept = (decay.start_time + decay.time, decay.values, fit.prediction, residual)
    series = {name: each[::stride].tolist() for name, each in zip(SERIES, kept, strict=True)}
    return {**texts, **numbers, **series}


def _friction(estimate: fb.Estimate) -> dict[str, float]:
    low, high = estimate.friction.ppf([0.05, 0.95])
    return {"friction": float(estimate.friction.mean()), "low": float(low), "high": float(high)}


def _reference(summary: Mapping[str, Any]) -> dict[str, Any]:
    low, high = summary["friction"]["interval90"]
    named = ("rhat", "ess_bulk", "ess_tail", "agrees", "sampler_s")
    return {
        "reference_mean": summary["friction"]["mean"],
        "reference_low": low,
        "reference_high": high,
        **{name: summary[name] for name in named},
    }


def _losses(decay: Any) -> dict[str, float]:
    """Loss of amplitude early and late, which plain dry friction makes equal.

    The angle of a pendulum is replaced by its sine integral, which friction lowers linearly in large swings.
    """
    try:
        cycles = half_cycles(decay)
    except fb.InputError:
        return {}
    drop: Array = cycles["drop"].values
    if decay.quantity.order == 0 and swing_frequency(decay.system, decay.unit) > 0.0:
        amplitude = [sine_integral(value) for value in cycles["amplitude"].values]
        drop = -np.diff(amplitude) / cycles.attrs["half_cycles_per_interval"]
    third = max(drop.size // 3, 1)
    return {
        "drop_early": float(drop[:third].mean()),
        "drop_late": float(drop[-third:].mean()),
        "half_cycles": float(drop.size),
    }


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Lay the cases out one after the other; series are padded with nan."""
    del cells
    longest = max(len(result["time"]) for result in results)
    dataset = xr.Dataset()
    for name in TEXTS:
        dataset[name] = ("case", [str(result[name]) for result in results])
    for name, meaning in NUMBERS.items():
        column = np.array([result[name] for result in results], dtype=np.float64)
        dataset[name] = ("case", column, {"long_name": meaning})
    for name in SERIES:
        padded = np.full((len(results), longest), np.nan)
        for row, result in zip(padded, results, strict=True):
            row[: len(result[name])] = result[name]
        dataset[name] = (("case", "sample"), padded)
    return dataset.assign_attrs(synthetic=0)


def rows(dataset: xr.Dataset) -> list[Row]:
    """One line a record and method."""
    return [_row(dataset.isel(case=k)) for k in range(dataset.sizes["case"])]


def _row(case: xr.Dataset) -> Row:
    what = f"{case['record'].item()}, {case['method'].item()}"
    if case["refused"].item():
        return Row(what, "refused", remark=case["refused"].item())
    value = {name: float(case[name]) for name in NUMBERS}
    verdict = {1.0: "agrees", 0.0: f"DISAGREES: {case['because'].item()}"}.get(value["agrees"], "not judged")
    colour = (
        "white"
        if value["ljung_box"] < 1.0
        else f"not white, successive ones correlate at {value['lag1']:.3f}"
    )
    return Row(
        what,
        f"{value['friction']:.5g} [{value['low']:.5g}, {value['high']:.5g}] {case['unit'].item()}",
        f"{100.0 * value['residual_sd']:.2g} % of the amplitude, {colour}",
        f"closed form {1e3 * value['closed_form_s']:.3g} ms, emcee {value['sampler_s']:.2g} s",
        f"{value['reference_mean']:.5g} [{value['reference_low']:.5g}, {value['reference_high']:.5g}], "
        f"R-hat {value['rhat']:.4f}, ESS {value['ess_bulk']:.0f}/{value['ess_tail']:.0f}, {verdict}",
    )


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """What plain dry friction leaves out, a line a record: loss of amplitude early and late, frequency."""
    lines = []
    for k in np.flatnonzero(dataset["method"].values == EXPERIMENT.config.methods[0]):
        case = dataset.isel(case=k)
        early, late, count = (float(case[name]) for name in ("drop_early", "drop_late", "half_cycles"))
        if not math.isfinite(early):
            continue
        lines.append(
            {
                "record": case["record"].item(),
                "half cycles": f"{count:.0f}",
                "loss a half cycle, first third": f"{early:.3g} {case['signal_unit'].item()}",
                "last third": f"{late:.3g} {case['signal_unit'].item()}",
                "early over late": f"{early / late:.2f}",
                "frequency over sqrt(k/m)": f"{float(case['frequency_ratio']):.4f}",
            }
        )
    return lines


EXPERIMENT = Experiment(
    name="measured_estimates",
    question="What do closed forms say of every measured record, does emcee agree, and what is left over?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    beside="signal less fit",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
