"""Ten decays of one rig without and ten with a damping magnet: is the damping found, and friction unmoved?"""

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
from friction_bayes.core.text import percent, set_words
from friction_bayes.mechanics.effects.position_force import POSITION_FORCE

__all__ = ["EXPERIMENT", "KINDS", "Config"]

KINDS = {"no-magnet": "without the magnet", "magnet": "with the magnet"}
DAMPING = "viscous_damping"
LEAST_PROBABILITY, MOST_SD = 0.9, 2.0
NUMBERS = {
    "viscous": "probability of viscous damping",
    "drag": "probability of viscous damping or quadratic drag",
    "friction": "posterior mean of the mean friction",
    "friction_sd": "its standard deviation",
    "spread": "posterior mean of the spread of friction between releases",
    "share": "median of the spread over friction",
    "reduced_chi_square": "of the frictions that the records have one by one",
    "elapsed": "wall time [s]",
}
ANGLES = np.linspace(-1.6, 1.6, 65)
"""Passed by all releases [rad]."""
CURVES = {"pull": "position force less its best line", "pull_sd": "posterior sd of that"}
TEXTS = ("verdict", "candidates", "failed", "unit", "position_force")


@dataclass(frozen=True)
class Config:
    """How many releases of each kind are evaluated together, and how many candidates the table has."""

    releases: int = 10
    candidates: int = 3


def cells(config: Config, full: bool) -> Sequence[Cell]:
    """The two kinds; ``full`` changes nothing."""
    del config, full
    return [{"kind": kind} for kind in KINDS]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on all releases of a kind, friction drawn anew for each."""
    names = [f"pasco-oscillator/{cell['kind']}-{k}" for k in range(1, config.releases + 1)]
    read = [fb.dataset_record(name) for name in names]
    report = fb.close_loop(
        [record for record, _ in read],
        read[0][1],
        seed=int(seed.generate_state(1)[0]),
        varying_friction=True,
    )
    between = report.friction_between_records
    assert between is not None
    return {
        "viscous": _probability(report, {DAMPING}),
        "drag": _probability(report, {DAMPING, "quadratic_drag"}),
        "friction": report.friction_after["mean"],
        "friction_sd": report.friction_after["sd"],
        "spread": between["spread"]["mean"],
        "share": between["share_of_friction"],
        "reduced_chi_square": between["reduced_chi_square"],
        "elapsed": report.elapsed_s,
        "verdict": report.verdict,
        "candidates": json.dumps(report.candidates[: config.candidates]),
        "failed": ", ".join(report.residual["after"]["failed"]),
        "unit": report.friction_after["unit"],
        "position_force": json.dumps(_coefficients(report, POSITION_FORCE.name)),
        **_pull(report),
    }


def _coefficients(report: fb.LoopReport, name: str) -> dict[str, tuple[float, float]]:
    """Posterior mean and sd of each parameter of an effect; none where it is not in the final law."""
    found = next((effect["parameters"] for effect in report.effects if effect["name"] == name), {})
    return {parameter: (summary["mean"], summary["sd"]) for parameter, summary in found.items()}


def _pull(report: fb.LoopReport) -> dict[str, list[float]]:
    """Force that repeats with every turn, over the angle, less a line, which goes with the spring."""
    draws = report.posterior["posterior"].to_dataset()
    names = [f"{POSITION_FORCE.name}.{parameter.name}" for parameter in POSITION_FORCE.parameters]
    if names[0] not in draws:
        return {name: [math.nan] * ANGLES.size for name in CURVES}
    waves = np.array([wave(n * ANGLES) for n in range(1, len(names) // 2 + 1) for wave in (np.sin, np.cos)])
    curves = np.array([draws[name].values.ravel() for name in names]).T @ waves
    line = np.vander(ANGLES, 2)
    curves -= (line @ np.linalg.lstsq(line, curves.T, rcond=None)[0]).T
    return {"pull": curves.mean(axis=0).tolist(), "pull_sd": curves.std(axis=0, ddof=1).tolist()}


def _probability(report: fb.LoopReport, names: set[str]) -> float:
    """Probability that any of some effects acts."""
    return float(sum(c["probability"] for c in report.candidates if names & set(c["effects"])))


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a kind."""
    dataset = xr.Dataset(coords={"kind": [str(cell["kind"]) for cell in cells]})
    for name, meaning in NUMBERS.items():
        dataset[name] = ("kind", [float(result[name]) for result in results], {"long_name": meaning})
    dataset = dataset.assign_coords(angle=ANGLES)
    for name, meaning in CURVES.items():
        values = [result[name] for result in results]
        dataset[name] = (("kind", "angle"), values, {"long_name": meaning, "units": "N m"})
    for name in TEXTS:
        dataset[name] = ("kind", [str(result[name]) for result in results])
    return dataset


def rows(dataset: xr.Dataset) -> list[Row]:
    """Damping with and without the magnet, and how far the frictions are apart."""
    table = [_damping(dataset.sel(kind=kind), words, kind == "magnet") for kind, words in KINDS.items()]
    without, magnet = (dataset.sel(kind=kind) for kind in KINDS)
    apart = float(magnet["friction"] - without["friction"])
    sds = abs(apart) / math.hypot(float(magnet["friction_sd"]), float(without["friction_sd"]))
    difference = Row(
        "friction with the magnet less without",
        f"{apart:+.2g} {magnet['unit'].item()}, {sds:.1f} sd",
        f"<= {MOST_SD:g} sd",
        "reached" if sds <= MOST_SD else "missed",
    )
    return [*table, difference, _the_same_force(without, magnet)]


def _the_same_force(without: xr.Dataset, magnet: xr.Dataset) -> Row:
    """Whether the force that repeats with every turn, found on either kind alone, is one and the same."""
    found = [json.loads(case["position_force"].item()) for case in (without, magnet)]
    what = "position force with the magnet against without, coefficient by coefficient"
    if not all(found):
        return Row(what, "not in both laws", "", "")
    # a series may be cut short: the terms that either kind lacks have no sd
    names = [name for name in found[0] if all(terms[name][1] > 0.0 for terms in found)]
    (a, a_sd), (b, b_sd) = (np.array([terms[name] for name in names]).T for terms in found)
    differs = np.mean((b - a) ** 2 / (a_sd**2 + b_sd**2))
    itself = 0.5 * np.mean((a / a_sd) ** 2 + (b / b_sd) ** 2)
    return Row(
        what,
        f"correlation {np.corrcoef(a, b)[0, 1]:.2f}; reduced chi-square of the difference {differs:.2g}, "
        f"of the force {itself:.2g}",
        "",
        f"{a.size} coefficients, each with its own sd; the kinds share no release",
    )


def _damping(case: xr.Dataset, words: str, sought: bool) -> Row:
    best = json.loads(case["candidates"].item())[0]
    remark = f"{case['verdict'].item()}: {set_words(best['effects'])} ({percent(best['probability'])})"
    viscous = float(case["viscous"])
    if sought:
        remark = f"{'reached' if viscous >= LEAST_PROBABILITY else 'missed'}; {remark}"
    return Row(
        f"P(viscous damping) {words}",
        f"{viscous:.2g}; {float(case['drag']):.2g} that or quadratic drag",
        f">= {LEAST_PROBABILITY:g}" if sought else "",
        remark,
    )


def details(dataset: xr.Dataset) -> list[dict[str, str]]:
    """Friction and its spread, what else was evaluated and what the tests say, a line a kind."""
    lines = []
    for kind, words in KINDS.items():
        case = dataset.sel(kind=kind)
        unit, value = case["unit"].item(), {name: float(case[name]) for name in NUMBERS}
        candidates = json.loads(case["candidates"].item())
        spread = f"{value['spread']:.1g} {unit}, {percent(value['share'])} of friction"
        lines.append(
            {
                "releases": words,
                "friction": f"{value['friction']:.3g} ± {value['friction_sd']:.1g} {unit}",
                "spread between releases": spread,
                "reduced chi-square": f"{value['reduced_chi_square']:.2g}",
                "candidates": "; ".join(
                    f"{set_words(c['effects'])} ({percent(c['probability'])})" for c in candidates
                ),
                "tests that fail": case["failed"].item() or "none",
                "time": f"{value['elapsed']:.0f} s",
            }
        )
    return lines


EXPERIMENT = Experiment(
    name="pasco_together",
    question="do ten releases evaluated together show a damping magnet, and friction as without it?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="target",
    group="measured",
    details=details,
)

if __name__ == "__main__":
    main(EXPERIMENT)
