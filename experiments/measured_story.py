"""One measured record from file to law: friction and residual under each likelihood and each law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.core.text import number, percent, set_words, with_interval, words

__all__ = ["EXPERIMENT", "LAWS", "Config"]

OFFSET = "sensor_offset"
LAWS: dict[str, dict[str, Any]] = {
    "noise in the sensor alone": {"random_force": "none"},
    "dry friction and a random force": {"effects": [OFFSET, "random_force"]},
    "the whole catalogue": {},
}
"""Options of :func:`friction_bayes.close_loop` for each stage."""
SERIES = ("time", "signal", "before", "displacement", "velocity", "force", "force_sd")


@dataclass(frozen=True)
class Config:
    """The record that is followed."""

    record: str = "pasco-oscillator/no-magnet-3"


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """One cell a stage; ``full`` changes nothing."""
    del config, full
    return [{"law": law} for law in LAWS]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on the record with the options of one stage."""
    record, system = fb.dataset_record(config.record)
    report = fb.close_loop([record], system, seed=int(seed.generate_state(1)[0]), **LAWS[cell["law"]])
    trace, force = report.traces[0], report.traces[0].fluctuation
    series: dict[str, list[float]] = {name: [] for name in SERIES}
    series |= {name: getattr(trace, name).tolist() for name in ("time", "signal", "before")}
    if force is not None:
        series |= {name: getattr(force, name).tolist() for name in ("displacement", "velocity", "force")}
        series["force_sd"] = force.sd.tolist()
    return series | {
        "unit": trace.unit,
        "force_unit": report.friction_after["unit"],
        "friction": report.friction_after["mean"],
        "coulomb": f"friction {with_interval(report.friction_before)}; {_tests(report.residual['before'])}",
        "best": f"{report.verdict}: {set_words(report.candidates[0]['effects'])} "
        f"({percent(report.candidates[0]['probability'])})",
        "effects": "; ".join(
            f"{words(effect['name'])} {percent(effect['probability'])}" for effect in report.effects
        ),
        "after": f"friction {with_interval(report.friction_after)}",
        "fluctuation": _fluctuation(report.random_force),
        "noise": _noise(report.noise, trace.unit),
        "left": _left(report.left),
        "held_out": f"{number(report.held_out_error['before'], 3)} → "
        f"{number(report.held_out_error['after'], 3)} {trace.unit}, "
        f"{percent(report.held_out_error['inside90'])} in the 90 % band",
    }


def _tests(tests: dict[str, Any]) -> str:
    failed = ", ".join(words(name) for name in tests["failed"]) or "none"
    return f"residual {number(tests['rms'], 3)}; tests that fail: {failed}"


def _fluctuation(force: dict[str, Any] | None) -> str:
    if force is None:
        return "not evaluated"
    share = force["share_of_friction"]
    size = "" if share is None else f", {100.0 * share:.0f} % of friction"
    return (
        f"probability {percent(force['probability'])}, sd {number(force['sd']['mean'], 3)} "
        f"± {number(force['sd']['sd'], 2)} {force['sd']['unit']}{size}, correlated over "
        f"{number(force['correlation_time_s']['mean'], 2)} s"
    )


def _noise(noise: dict[str, Any], unit: str) -> str:
    text = f"{noise['model']}, sd {number(noise['sd'], 3)} {unit}"
    if not noise["step"]:
        return text
    return f"{text}, {number(noise['sd'] * 12.0**0.5 / noise['step'], 3)} of step / sqrt(12)"


def _left(left: dict[str, Any]) -> str:
    if not left["depends_on"]:
        return (
            "nothing that follows the motion" if not left["structured_rms"] else "a residual that is no noise"
        )
    return f"by {left['depends_on']}; {percent(left['share'])} of it {left['shape']}"


TEXTS = ("coulomb", "best", "effects", "after", "fluctuation", "noise", "left", "held_out")


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a stage; series are padded with nan."""
    dataset = xr.Dataset(coords={"law": [str(cell["law"]) for cell in cells]})
    for name in (*TEXTS, "unit", "force_unit"):
        dataset[name] = ("law", [str(result[name]) for result in results])
    dataset["friction"] = ("law", [result["friction"] for result in results])
    longest = max(len(result["time"]) for result in results)
    for name in SERIES:
        padded = np.full((len(results), longest), np.nan)
        for row, result in zip(padded, results, strict=True):
            row[: len(result[name])] = result[name]
        dataset[name] = (("law", "sample"), padded)
    return dataset


def rows(dataset: xr.Dataset) -> list[Row]:
    """The residual of the Coulomb model, then friction by each stage."""
    first = dataset.isel(law=0)
    return [
        Row("the Coulomb model alone", first["coulomb"].item()),
        *(
            Row(case["law"].item(), case["after"].item(), case["best"].item(), case["left"].item())
            for case in (dataset.isel(law=k) for k in range(dataset.sizes["law"]))
        ),
    ]


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """The random force, the noise and the forecast of each stage."""
    return [
        {
            "stage": case["law"].item(),
            "effects": case["effects"].item() or "none",
            "random force": case["fluctuation"].item(),
            "noise of the sensor": case["noise"].item(),
            "held out": case["held_out"].item(),
        }
        for case in (dataset.isel(law=k) for k in range(dataset.sizes["law"]))
    ]


EXPERIMENT = Experiment(
    name="measured_story",
    question="what do friction and residual of one measured record become with each likelihood and each law?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="verdict",
    group="measured",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
