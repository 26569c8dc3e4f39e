"""What does the loop make of every measured record, and how much better does it forecast it?"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.text import number, percent, set_words
from friction_bayes.records.datasets import DATASETS

__all__ = ["EXPERIMENT", "Config", "series_of"]

TARGET_RATIO = 0.3
SERIES = ("time", "signal", "before", "after")
NUMBERS = {
    "probability": "of the most probable candidate",
    "friction_before": "posterior mean of the Coulomb model alone",
    "friction_after": "posterior mean over the candidates",
    "friction_after_sd": "its standard deviation",
    "held_out_before": "RMS error over the last 30 %, fitted to the first 70 %",
    "held_out_after": "the same of the final model",
    "noise_floor": "RMS residual of the final model fitted to all",
    "rms_before": "RMS residual of the Coulomb model alone fitted to all",
    "rms_after": "the same of the final model",
    "noise_order": "order of the autoregression, 0 for white",
    "correlation_length": "of the noise [s]",
    "elapsed": "wall time [s]",
}
TEXTS = ("verdict", "candidates", "parameters", "failed", "next_experiment", "force_unit", "unit", "refused")


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
    try:
        report = fb.close_loop([record], system, seed=int(seed.generate_state(1)[0]))
    except fb.InputError as error:
        return empty | {"refused": str(error)}
    told, error = report.to_dict(), report.held_out_error
    numbers = {
        "probability": told["candidates"][0]["probability"],
        "friction_before": told["friction_before"]["mean"],
        "friction_after": told["friction_after"]["mean"],
        "friction_after_sd": told["friction_after"]["sd"],
        "held_out_before": error["before"],
        "held_out_after": error["after"],
        "noise_floor": error["noise_floor"],
        "rms_before": told["residual"]["before"]["rms"],
        "rms_after": told["residual"]["after"]["rms"],
        "noise_order": told["noise"]["order"],
        "correlation_length": told["noise"]["correlation_length_s"],
        "elapsed": told["elapsed_s"],
    }
    texts = {
        "verdict": told["verdict"],
        "candidates": json.dumps(told["candidates"][: config.candidates]),
        "parameters": _parameters(told["effects"]),
        "failed": ", ".join(told["residual"]["after"]["failed"]),
        "next_experiment": told["next_experiment"] or "",
        "force_unit": told["friction_after"]["unit"],
        "unit": error["unit"],
    }
    return empty | numbers | texts | series_of(report.traces[0], config.points)


def series_of(trace: Any, points: int) -> dict[str, list[float]]:
    """What a figure of a record needs, thinned: time, signal and both predictions."""
    stride = math.ceil(trace.time.size / points)
    return {name: getattr(trace, name)[::stride].tolist() for name in SERIES}


def _parameters(effects: Sequence[dict[str, Any]]) -> str:
    told = []
    for effect in effects:
        for name, p in effect["parameters"].items():
            unit = "" if p["unit"] == "1" else f" {p['unit']}"
            told.append(f"{name.replace('_', ' ')} {number(p['mean'], 3)} ± {number(p['sd'], 2)}{unit}")
    return "; ".join(told)


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
    """The median first, then one line a record."""
    ratio = dataset["ratio"].values
    # what could not be forecast counts as no gain
    median = float(np.median(np.where(np.isfinite(ratio), ratio, 1.0)))
    word = "reached" if median <= TARGET_RATIO else "missed"
    table = [
        Row(
            f"median held-out error after over before, {ratio.size} records",
            f"{median:.2g}",
            f"<= {TARGET_RATIO:g}",
            word,
        )
    ]
    return table + [_row(dataset.isel(record=k)) for k in range(ratio.size)]


def _row(case: xr.Dataset) -> Row:
    name = case["record"].item()
    if case["refused"].item():
        return Row(name, "refused", "", case["refused"].item())
    value = {key: float(case[key]) for key in (*NUMBERS, "ratio")}
    unit = case["unit"].item()
    return Row(
        name,
        f"{value['held_out_before']:.3g} → {value['held_out_after']:.3g} {unit}",
        f"{value['ratio']:.2g}",
        f"{case['verdict'].item()}: {_best(case)}",
    )


def _best(case: xr.Dataset) -> str:
    best = json.loads(case["candidates"].item())[0]
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
                "left: tests that fail": case["failed"].item() or "none",
                "authors assume": DATASETS[case["record"].item().split("/")[0]].authors_assume,
                "time": f"{value['elapsed']:.1f} s",
            }
        )
    return lines


EXPERIMENT = Experiment(
    name="loop_measured",
    question="what does the loop make of measured records, and how much better does it forecast them?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    beside="after / before, target",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
