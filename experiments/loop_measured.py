"""Which law does the loop find for every measured record, and how much better does it forecast it?"""

from __future__ import annotations

import json
import math
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.runner import Cell, Experiment, Row, main
from experiments.same_rig import RIGS, records_of, reduced_chi_square, sd_of_interval
from friction_bayes.core.text import number, percent, set_words
from friction_bayes.records.datasets import DATASETS

__all__ = ["EXPERIMENT", "Config", "series_of"]

TARGET_RATIO = 0.2
WORST_RATIO = 1.05
LARGEST_CHI_SQUARE = 2.0
LEAST_CLEAR = 0.8
COVERAGE = (0.8, 0.97)
NOISE_OVER_STEP = (0.7, 1.3)
ENCODERS = ("map-single-pendulum/", "pasco-oscillator/", "rotary-pendulum/")
"""Whose step is known: the noise of the sensor should be that of its rounding."""
DRY_FRICTION = {"free": (0.0, 0.1), "cardboard": (0.0, 0.1), "rubbing": (0.95, 1.0)}
"""Between what the probability that dry friction matters should lie, by record of ``spring-with-dampers``."""
MOST_PROCESSOR_TIME = 0.5
"""Of a record of 10,000 samples [s]."""
SERIES = ("time", "signal", "before", "after")
NUMBERS = {
    "probability": "of the most probable candidate",
    "friction_before": "posterior mean of the Coulomb model alone",
    "friction_after": "posterior mean over the candidates",
    "friction_after_sd": "its standard deviation",
    "friction_after_low": "lower end of its 90 % interval",
    "friction_after_high": "upper end",
    "dry_friction": "probability that dry friction matters",
    "dry_friction_upper": "what it lies below with 95 %",
    "held_out_before": "RMS error over the last 30 %, fitted to the first 70 %",
    "held_out_after": "the same of the final model",
    "held_out_mcse": "its Monte Carlo error",
    "held_out_expected": "RMS of the standard deviation that the final model states of its forecast",
    "inside90": "share of the held-out samples in the predictive 90 % band",
    "held_out_samples": "samples forecast",
    "noise_floor": "RMS residual of the final model fitted to all",
    "rms_before": "RMS residual of the Coulomb model alone fitted to all",
    "rms_after": "the same of the final model",
    "noise_order": "order of the autoregression, 0 for white",
    "correlation_length": "of the noise [s]",
    "noise_over_step": "sd of the sensor's noise over its step over sqrt(12)",
    "random_force": "probability of a random force",
    "random_force_share": "its sd over friction",
    "shape_share": "of what follows the motion, that the shape named takes",
    "samples": "in the record",
    "processor": "processor time, with what a worker loads for its first record [s]",
}
TEXTS = (
    "verdict",
    "candidates",
    "parameters",
    "failed",
    "next_experiment",
    "force_unit",
    "unit",
    "refused",
    "depends_on",
    "shape",
    "witnesses",
)


@dataclass(frozen=True)
class Config:
    """How much of a record is kept for its figure, and how many candidates for the table."""

    points: int = 1500
    candidates: int = 3


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """Every part of every registered set; ``full`` changes nothing."""
    del config, full
    return [
        {"record": f"{data_set.name}/{part}"} for data_set in DATASETS.values() for part in data_set.parts
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on one record with the system that its set declares."""
    record, system = fb.dataset_record(cell["record"])
    empty = dict.fromkeys(TEXTS, "") | dict.fromkeys(NUMBERS) | {name: [] for name in SERIES}
    own = int(seed.generate_state(1)[0])
    try:
        started = time.process_time()
        report = fb.close_loop([record], system, seed=own)
        processor = time.process_time() - started
    except fb.InputError as error:
        return empty | {"refused": str(error)}
    fields, error = report.to_dict(), report.held_out_error
    left, force, ahead = fields["left"], fields["random_force"] or {}, report.traces[0].forecasts
    low, high = fields["friction_after"]["interval90"]
    step = fields["noise"]["step"]
    numbers = {
        "probability": fields["candidates"][0]["probability"],
        "friction_before": fields["friction_before"]["mean"],
        "friction_after": fields["friction_after"]["mean"],
        "friction_after_sd": fields["friction_after"]["sd"],
        "friction_after_low": low,
        "friction_after_high": high,
        "dry_friction": fields["dry_friction"]["probability"],
        "dry_friction_upper": fields["dry_friction"]["upper95"],
        "held_out_before": error["before"],
        "held_out_after": error["after"],
        "held_out_mcse": error["after_mcse"],
        "held_out_expected": None if ahead is None else float(np.sqrt(np.mean(ahead[1].sd ** 2))),
        "inside90": fields["held_out_error"]["inside90"],
        "held_out_samples": 0 if ahead is None else ahead[1].time.size,
        "noise_floor": error["noise_floor"],
        "rms_before": fields["residual"]["before"]["rms"],
        "rms_after": fields["residual"]["after"]["rms"],
        "noise_order": fields["noise"]["order"],
        "correlation_length": fields["noise"]["correlation_length_s"],
        "noise_over_step": fields["noise"]["sd"] * math.sqrt(12.0) / step if step else None,
        "random_force": force.get("probability"),
        "random_force_share": force.get("share_of_friction"),
        "shape_share": left["share"],
        "samples": record.size,
        "processor": processor,
    }
    texts = {
        "verdict": fields["verdict"],
        "candidates": json.dumps(fields["candidates"][: config.candidates]),
        "parameters": _parameters(fields["effects"]),
        "failed": ", ".join(fields["residual"]["after"]["failed"]),
        "next_experiment": fields["next_experiment"] or "",
        "force_unit": fields["friction_after"]["unit"],
        "unit": error["unit"],
        "depends_on": left["depends_on"] or "",
        "shape": left["shape"] or "",
        "witnesses": _witnesses(fields["witnesses"]),
    }
    return empty | numbers | texts | series_of(report.traces[0], config.points)


def series_of(trace: Any, points: int) -> dict[str, list[float]]:
    """What a figure of a record needs, thinned: time, signal and both predictions."""
    stride = math.ceil(trace.time.size / points)
    return {name: getattr(trace, name)[::stride].tolist() for name in SERIES}


def _witnesses(witnesses: dict[str, Any] | None) -> str:
    """Friction by the loss of amplitude and by the shape within a cycle."""
    if witnesses is None:
        return ""
    loss, shape = (
        f"{number(witnesses[name]['mean'], 3)} ± {number(witnesses[name]['sd'], 1)}"
        for name in ("loss", "shape")
    )
    word = "agree" if witnesses["agree"] else "DISAGREE"
    return f"{loss} and {shape} {witnesses['loss']['unit']}: {word}"


def _parameters(effects: Sequence[dict[str, Any]]) -> str:
    parts = []
    for effect in effects:
        for name, p in effect["parameters"].items():
            unit = "" if p["unit"] == "1" else f" {p['unit']}"
            parts.append(f"{name.replace('_', ' ')} {number(p['mean'], 3)} ± {number(p['sd'], 2)}{unit}")
    return "; ".join(parts)


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a record; series are padded with nan."""
    dataset = xr.Dataset(coords={"record": [str(cell["record"]) for cell in cells]})
    for name, meaning in NUMBERS.items():
        column = np.array([result[name] for result in results], dtype=np.float64)
        dataset[name] = ("record", column, {"long_name": meaning})
    for name in TEXTS:
        dataset[name] = ("record", [str(result[name]) for result in results])
    longest = max(len(result["time"]) for result in results)
    for name in SERIES:
        padded = np.full((len(results), longest), np.nan)
        for row, result in zip(padded, results, strict=True):
            row[: len(result[name])] = result[name]
        dataset[name] = (("record", "sample"), padded)
    dataset["ratio"] = dataset["held_out_after"] / dataset["held_out_before"]
    return dataset


def rows(dataset: xr.Dataset) -> list[Row]:
    """What was to be reached first, then one line a record."""
    names = dataset["record"].values.tolist()
    return [
        *_held_out_rows(dataset),
        _verdict_row(dataset),
        *_rig_rows(dataset, names),
        *_dry_friction_rows(dataset, names),
        *_sensor_rows(dataset, names),
        _time_row(dataset),
        *(_row(dataset.isel(record=k)) for k in range(len(names))),
    ]


def _target(what: str, ours: float, low: float, high: float, target: str) -> Row:
    """A figure and its target; an unknown figure misses it."""
    return Row(what, f"{ours:.2g}", target, "reached" if low <= ours <= high else "missed")


def _held_out_rows(dataset: xr.Dataset) -> list[Row]:
    ratio, inside = dataset["ratio"].values, dataset["inside90"].values
    # what could not be forecast counts as no gain
    known = np.where(np.isfinite(ratio), ratio, 1.0)
    count = np.where(np.isfinite(inside), dataset["held_out_samples"].values, 0.0)
    pooled = float(np.nansum(inside * count) / max(count.sum(), 1.0))
    each = float(np.nanmean(inside)) if np.isfinite(inside).any() else math.nan
    low, high = COVERAGE
    between = f"{100.0 * low:.0f} to {100.0 * high:.0f} %"
    median, worst = float(np.median(known)), float(known.max())
    expected = dataset["held_out_expected"].values / dataset["held_out_before"].values
    what = "held-out samples in the predictive 90 % band"
    return [
        _target(
            f"median held-out error after over before, {ratio.size} records",
            median,
            0.0,
            TARGET_RATIO,
            f"<= {TARGET_RATIO:g}",
        ),
        _target("largest of them", worst, 0.0, WORST_RATIO, f"<= {WORST_RATIO:g}"),
        Row(
            "median of the error that the final law states of its forecast, over the error before",
            f"{np.nanmedian(expected):.2g}",
            "",
            "what random force, noise and parameters leave open: no better can be expected of that law",
        ),
        _target(f"{what}, pooled over all samples", pooled, low, high, between),
        _target(f"{what}, mean over the records", each, low, high, between),
    ]


def _verdict_row(dataset: xr.Dataset) -> Row:
    words = Counter(dataset["verdict"].values.tolist())
    clear = sum(words[word] for word in ("adequate", "explained", "ambiguous")) / dataset.sizes["record"]
    counts = ", ".join(f"{count} {word or 'refused'}" for word, count in words.most_common())
    return Row(
        "records adequate, explained or ambiguous",
        f"{100.0 * clear:.0f} %: {counts}",
        f">= {100.0 * LEAST_CLEAR:.0f} %",
        "reached" if clear >= LEAST_CLEAR else "missed",
    )


def _rig_rows(dataset: xr.Dataset, names: Sequence[str]) -> list[Row]:
    table = []
    for rig in RIGS:
        own = dataset.isel(record=records_of(rig, names))
        if own.sizes["record"] < 2:
            continue
        # of friction itself the sd of the interval, as tails do not count
        sd = sd_of_interval(own["friction_after_low"].values, own["friction_after_high"].values)
        found = reduced_chi_square(own["friction_after"].values, sd)
        table.append(
            _target(
                f"{rig}: reduced chi-square of friction between {own.sizes['record']} records",
                found,
                0.0,
                LARGEST_CHI_SQUARE,
                f"<= {LARGEST_CHI_SQUARE:g}",
            )
        )
    return table


def _dry_friction_rows(dataset: xr.Dataset, names: Sequence[str]) -> list[Row]:
    table = []
    for part, (low, high) in DRY_FRICTION.items():
        name = f"spring-with-dampers/{part}"
        if name in names:
            case = dataset.isel(record=names.index(name))
            p, upper = float(case["dry_friction"]), number(float(case["dry_friction_upper"]), 2)
            row = Row(
                f"{name}: probability that dry friction matters",
                f"{percent(p)}, below {upper} {case['force_unit'].item()} with 95 %",
                f"< {100.0 * high:.0f} %" if low == 0.0 else f"> {100.0 * low:.0f} %",
                "reached" if low <= p <= high else "missed",
            )
            table.append(row)
    return table


def _sensor_rows(dataset: xr.Dataset, names: Sequence[str]) -> list[Row]:
    low, high = NOISE_OVER_STEP
    table = []
    for rig in ENCODERS:
        own = dataset.isel(record=[k for k, name in enumerate(names) if name.startswith(rig)])
        ratio = own["noise_over_step"].values
        ratio = ratio[np.isfinite(ratio)]
        if ratio.size:
            inside = int(np.count_nonzero((ratio >= low) & (ratio <= high)))
            row = Row(
                f"{rig.rstrip('/')}: noise of the sensor over its step over sqrt(12)",
                f"{ratio.min():.2g} to {ratio.max():.2g}; {inside} of {ratio.size} records with a step",
                f"{low:g} to {high:g}",
                "reached" if inside == ratio.size else "missed",
            )
            table.append(row)
    return table


def _time_row(dataset: xr.Dataset) -> Row:
    return _target(
        f"processor time of a record, median; {dataset['samples'].min():.0f} to "
        f"{dataset['samples'].max():.0f} samples [s]",
        float(np.nanmedian(dataset["processor"].values)),
        0.0,
        MOST_PROCESSOR_TIME,
        f"<= {MOST_PROCESSOR_TIME:g} for 10,000",
    )


def _row(case: xr.Dataset) -> Row:
    name = case["record"].item()
    if case["refused"].item():
        return Row(name, "refused", "", case["refused"].item())
    value = {key: float(case[key]) for key in (*NUMBERS, "ratio")}
    unit = case["unit"].item()
    after = f"{value['held_out_after']:.3g} ± {value['held_out_mcse']:.1g}"
    return Row(
        name,
        f"{value['held_out_before']:.3g} → {after} {unit}",
        f"{value['ratio']:.2g}",
        f"{case['verdict'].item()}: {_best(case)}",
    )


def _best(case: xr.Dataset) -> str:
    best = json.loads(case["candidates"].item())[0]
    if case["verdict"].item() == "unexplained":
        return f"{set_words(best['effects'])} is the closest"
    return f"{set_words(best['effects'])} ({percent(best['probability'])})"


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """What was found, what stays unexplained, and what the authors assume, a line a record."""
    lines = []
    for k in range(dataset.sizes["record"]):
        case = dataset.isel(record=k)
        if case["refused"].item():
            continue
        value = {key: float(case[key]) for key in NUMBERS}
        order = int(value["noise_order"])
        noise = f"AR({order}) over {value['correlation_length']:.2g} s" if order else "white"
        force, unit = case["force_unit"].item(), case["unit"].item()
        lines.append(
            {
                "record": case["record"].item(),
                "friction before → after": f"{value['friction_before']:.3g} → {value['friction_after']:.3g} "
                f"± {value['friction_after_sd']:.1g} {force}",
                "found": case["parameters"].item() or "nothing",
                "residual RMS": f"{value['rms_before']:.2g} → {value['rms_after']:.2g} {unit}, {noise}",
                "noise over step / sqrt(12)": number(value["noise_over_step"], 3)
                if math.isfinite(value["noise_over_step"])
                else "no step",
                "random force": _share(value),
                "by the loss of amplitude, by the shape within a cycle": case["witnesses"].item(),
                "left: tests that fail": case["failed"].item() or "none",
                "left: what follows the motion": _left(case),
                "in the 90 % band": percent(value["inside90"]) if math.isfinite(value["inside90"]) else "",
                "authors assume": DATASETS[case["record"].item().split("/")[0]].authors_assume,
                "processor time": f"{value['processor']:.1f} s, {value['samples']:.0f} samples",
            }
        )
    return lines


def _share(value: dict[str, float]) -> str:
    if not value["random_force"] > 0.5:
        return ""
    share = value["random_force_share"]
    return f"{100.0 * share:.0f} % of friction" if math.isfinite(share) else "no friction to compare with"


def _left(case: xr.Dataset) -> str:
    on, shape = case["depends_on"].item(), case["shape"].item()
    return f"by {on}; {percent(float(case['shape_share']))} of it {shape}" if on else ""


EXPERIMENT = Experiment(
    name="loop_measured",
    question="which laws does the loop find for measured records, and how much better do they forecast them?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="target; after / before",
    group="measured",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
