"""What do closed forms estimate on measured records, with a random force and without? Does emcee agree?"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.against_emcee import SAMPLED, sampled, verdict_rows, word
from experiments.closed_forms import closed_form_seconds
from experiments.runner import Cell, Experiment, main
from experiments.same_rig import RIGS, records_of, reduced_chi_square, sd_of_interval
from experiments.tables import Row
from friction_bayes.core.arrays import Array
from friction_bayes.core.summary import TAILS
from friction_bayes.core.text import number, of_friction, percent
from friction_bayes.decay.half_cycles import half_cycles
from friction_bayes.decay.sensor_calibration import swing_frequency
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.mechanics.pendulum import sine_integral
from friction_bayes.records.datasets import dataset_record, list_datasets
from friction_bayes.records.quantisation import quantisation_step

__all__ = ["EXPERIMENT", "Config"]

SERIES = ("time", "signal", "fit", "residual")
NUMBERS = {
    "friction": "posterior mean, averaged over a random force where the method does so",
    "low": "lower end of the 90 % interval",
    "high": "upper end of the 90 % interval",
    "friction_without": "posterior mean with sensor noise alone, at the declared system",
    "low_without": "lower end of its 90 % interval",
    "high_without": "upper end of it",
    "force_probability": "of a random force",
    "force_sd": "mean of its standard deviation, in the unit of friction",
    "force_share": "the same over friction",
    "force_time": "mean of its correlation time [s]",
    "innovations": "Ljung-Box statistic of the innovations under it over its 99.9 % quantile for white noise",
    "closed_form_s": "wall time of the closed form [s]",
    **{name: meaning for name, (_, meaning) in SAMPLED.items()},
    **{f"{name}_without": f"{meaning}, without a random force" for name, (_, meaning) in SAMPLED.items()},
    "frequency_ratio": "frequency found over the declared sqrt(k/m)",
    "noise_sd": "posterior mean of the noise of a sample",
    "rounding": "sd of the rounding to whole steps of the sensor, where it has any",
    "residual_sd": "standard deviation of signal less fit, over half the signal's span",
    "ljung_box": "Ljung-Box statistic of the residuals over its 99.9 % quantile for white noise",
    "drop_early": "loss of amplitude (sine integral of a pendulum's angle) a half cycle, first third",
    "drop_late": "the same over the last third",
    "half_cycles": "half cycles between fitted turning points",
}
TEXTS = ("record", "method", "unit", "signal_unit", "quantity", "refused")
INTERPOLATED_ENCODERS = {"map-single-pendulum": 2.0 * math.pi / 40000.0}
"""Steps [rad] of encoders whose readings their hardware interpolates between counts by its clock, so that
the records show none."""
UNSAMPLED = ("video-pendulum/1",)
"""A large swing over six minutes, whose likelihood without a random force takes the sampler hours."""
LARGEST_CHI_SQUARE = 2.0
"""Of friction between records of one rig, reduced, to reach."""


@dataclass(frozen=True)
class Config:
    """Which estimators look at the records, and how much of a record is kept for its figure.

    Every posterior goes through emcee, by the likelihood it is of.
    """

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
    record, system = dataset_record(cell["record"])
    with warnings.catch_warnings():
        # what is warned of, a frequency or a sampler that did not converge, is among the numbers
        warnings.simplefilter("ignore")
        try:
            estimate = fb.estimate(record, system, method=cell["method"])
            plain = fb.estimate(record, system, method=cell["method"], random_force="none")
        except fb.InputError as error:
            return {**texts, **numbers, **series, "refused": str(error)}
        of_sampler, of_other = seed.generate_state(2).tolist()
        numbers |= sampled(estimate, seed=of_sampler)
        if estimate.random_force is not None and cell["record"] not in UNSAMPLED:
            without = sampled(plain, seed=of_other)
            numbers |= {f"{name}_without": value for name, value in without.items()}
    decay, fit = estimate.decay, estimate.fit
    assert fit.prediction is not None
    residual = decay.values - fit.prediction
    numbers |= _friction(estimate) | _force(estimate) | _losses(decay)
    numbers["closed_form_s"] = closed_form_seconds(record, system, method=cell["method"])
    test = whiteness(residual)
    numbers |= {
        "frequency_ratio": estimate.frequency / system.natural_frequency,
        "noise_sd": estimate.noise_sd,
        "rounding": _step(cell["record"], record) / math.sqrt(12.0),
        "residual_sd": float(residual.std() / (0.5 * np.ptp(decay.values))),
        "ljung_box": test.statistic / test.limit,
    }
    texts |= {
        "unit": estimate.friction_unit,
        "signal_unit": decay.unit,
        "quantity": decay.quantity.name,
    }
    stride = math.ceil(decay.values.size / config.points)
    kept = (decay.start_time + decay.time, decay.values, fit.prediction, residual)
    series = {name: each[::stride].tolist() for name, each in zip(SERIES, kept, strict=True)}
    return {**texts, **numbers, **series}


def _step(name: str, record: xr.DataArray) -> float:
    """Step of the sensor, unit of the signal; nan where there is none."""
    found = quantisation_step(record.values)
    return INTERPOLATED_ENCODERS.get(name.split("/")[0], math.nan) if found is None else found


def _friction(estimate: fb.Estimate) -> dict[str, float]:
    force = estimate.random_force
    without = estimate.friction if force is None else force.coefficient_without
    numbers = {}
    for distribution, suffix in ((estimate.friction, ""), (without, "_without")):
        low, high = distribution.ppf(TAILS)
        mean = float(distribution.mean())
        numbers |= {f"friction{suffix}": mean, f"low{suffix}": float(low), f"high{suffix}": float(high)}
    return numbers


def _force(estimate: fb.Estimate) -> dict[str, float]:
    force = estimate.random_force
    if force is None:
        return {}
    return {
        "force_probability": force.probability,
        "force_sd": float(force.sd.mean()),
        "force_share": force.share_of_friction,
        "force_time": float(force.correlation_time.mean()),
        "innovations": force.innovations.statistic / force.innovations.limit,
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
    """Agreement between records of one rig, and with emcee; then a line a record and method."""
    table = _rig_rows(dataset) + _verdicts(dataset)
    return table + [_row(dataset.isel(case=k)) for k in range(dataset.sizes["case"])]


def _verdicts(dataset: xr.Dataset) -> list[Row]:
    """How many posteriors agree with emcee, by method, and those without a random force."""
    table = []
    for method in dict.fromkeys(dataset["method"].values.tolist()):
        for suffix, what in (("", method), ("_without", f"{method} without a random force")):
            own = _by_emcee(dataset.isel(case=dataset["method"].values == method), suffix)
            table += verdict_rows(own.expand_dims(what=[what]), "what")
    return table


def _by_emcee(dataset: xr.Dataset, suffix: str) -> xr.Dataset:
    """Results of emcee with or without a random force, under the names of :data:`SAMPLED`."""
    return dataset[[f"{name}{suffix}" for name in SAMPLED]].rename(
        {f"{name}{suffix}": name for name in SAMPLED if suffix}
    )


def _rig_rows(dataset: xr.Dataset) -> list[Row]:
    cases = dataset.isel(case=dataset["method"].values == EXPERIMENT.config.methods[0])
    table = []
    for rig in RIGS:
        own = cases.isel(case=records_of(rig, cases["record"].values.tolist()))
        if own.sizes["case"] < 2:
            continue
        found, plain = (
            reduced_chi_square(
                own[f"friction{suffix}"].values,
                sd_of_interval(own[f"low{suffix}"].values, own[f"high{suffix}"].values),
            )
            for suffix in ("", "_without")
        )
        word = "reached" if found <= LARGEST_CHI_SQUARE else "missed"
        table.append(
            Row(
                f"{rig}: reduced chi-square of friction between {own.sizes['case']} records",
                f"{found:.2g}",
                f"{plain:.2g}",
                f"<= {LARGEST_CHI_SQUARE:g} with it: {word}",
            )
        )
    return table


def _row(case: xr.Dataset) -> Row:
    what = f"{case['record'].item()}, {case['method'].item()}"
    if case["refused"].item():
        return Row(what, "refused", remark=case["refused"].item())
    value = {name: float(case[name]) for name in NUMBERS}
    unit = case["unit"].item()
    averaged = math.isfinite(value["force_probability"])
    return Row(
        what,
        f"{_interval(value, 'friction', 'low', 'high', 4)} {unit}",
        f"{_interval(value, 'friction_without', 'low_without', 'high_without')} {unit}" if averaged else "",
        _random_force(value, unit),
        _sampled(case, value),
    )


def _sampled(case: xr.Dataset, value: Mapping[str, float]) -> str:
    sampled = (
        f"{_interval(value, 'reference_mean', 'reference_low', 'reference_high', 4)}: "
        f"{word(_by_emcee(case, ''))}, {value['sampler_s']:.2g} s where the closed form takes "
        f"{1e3 * value['closed_form_s']:.2g} ms"
    )
    without = word(_by_emcee(case, "_without"))
    return f"{sampled}. Without a force: {without}" if without else sampled


def _interval(value: Mapping[str, float], mean: str, low: str, high: str, digits: int = 5) -> str:
    return f"{value[mean]:.{digits}g} [{value[low]:.{digits}g}, {value[high]:.{digits}g}]"


def _random_force(value: Mapping[str, float], unit: str) -> str:
    left = f"fit leaves {100.0 * value['residual_sd']:.2g} % of the amplitude, {_colour(value['ljung_box'])}"
    if not math.isfinite(value["force_probability"]):
        return left
    return (
        f"{left}; random force {percent(value['force_probability'])}, "
        f"sd {number(value['force_sd'], 2)} {unit}"
        f"{of_friction(value['force_share'], (value['low'], value['high']))}, "
        f"over {number(value['force_time'], 2)} s, "
        f"innovations {_colour(value['innovations'])}"
    )


def _colour(ljung_box: float) -> str:
    return "white" if ljung_box < 1.0 else "not white"


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """A line a record: sensor noise, and what plain dry friction leaves out in amplitude and frequency."""
    lines = []
    for k in np.flatnonzero(dataset["method"].values == EXPERIMENT.config.methods[0]):
        case = dataset.isel(case=k)
        value = {name: float(case[name]) for name in NUMBERS}
        if case["refused"].item():
            continue
        unit = case["signal_unit"].item()
        early, late, count = value["drop_early"], value["drop_late"], value["half_cycles"]
        known = math.isfinite(early)
        ratio = value["noise_sd"] / value["rounding"]
        lines.append(
            {
                "record": case["record"].item(),
                "sensor noise": f"{value['noise_sd']:.3g} {unit}",
                "over the sensor's step / sqrt(12)": f"{ratio:.2f}" if math.isfinite(ratio) else "–",
                "half cycles": f"{count:.0f}" if known else "–",
                "loss a half cycle, first third": f"{early:.3g} {unit}" if known else "–",
                "last third": f"{late:.3g} {unit}" if known else "–",
                "early over late": f"{early / late:.2f}" if known else "–",
                "frequency over sqrt(k/m)": f"{value['frequency_ratio']:.4f}",
            }
        )
    return lines


EXPERIMENT = Experiment(
    name="measured_estimates",
    question="What do closed forms estimate on measured records, with and without a random force?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="without a random force",
    group="measured",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
