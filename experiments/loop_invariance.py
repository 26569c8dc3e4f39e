"""Does a report stay what it is where nothing about the record changes but how it is written?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.blind import generator
from experiments.blind.misleading_records import MISLEADING, draw_misleading
from experiments.blind.near_threshold import KINDS, draw_near_threshold
from experiments.runner import Cell, Experiment, Row, main
from friction_bayes.records.record import with_values

__all__ = ["EXPERIMENT"]

_THRESHOLD = {
    **dict.fromkeys(KINDS, draw_near_threshold),
    **dict.fromkeys(MISLEADING, draw_misleading),
}
_PLAIN = tuple(f"plainly {kind}" for kind in generator.KINDS)
_KINDS = (*_THRESHOLD, *_PLAIN)
_SHIFT = 0.37
"""Of the largest value: no round number of the sensor's steps."""
_LARGER = 1000.0
_MEAN_MOVES, _END_MOVES = 0.1, 0.25
"""Targets, in standard deviations."""


@dataclass(frozen=True)
class _Change:
    """How a record and its declared system are written anew, and by what friction is then larger.

    Not every change is one ``of_angles`` too: how far a machine turns has consequences.
    """

    record: Callable[[xr.DataArray], xr.DataArray] = lambda record: record
    system: Callable[[dict[str, float]], dict[str, float]] = lambda declared: declared
    seed: int = 1
    factor: float = 1.0
    of_angles: bool = True


def _times(record: xr.DataArray, factor: float) -> xr.DataArray:
    return with_values(record, factor * record.values)


def _shifted(record: xr.DataArray) -> xr.DataArray:
    return with_values(record, record.values + _SHIFT * float(np.max(np.abs(record.values))))


def _heavier(declared: dict[str, float]) -> dict[str, float]:
    return {name: _LARGER * value for name, value in declared.items()}


_AS_IT_IS = "as it is"
_CHANGES: dict[str, _Change] = {
    _AS_IT_IS: _Change(),
    "mirrored": _Change(record=lambda record: _times(record, -1.0)),
    "shifted by a constant": _Change(record=_shifted),
    "a sample less": _Change(record=lambda record: record[:-1]),
    "in grams": _Change(system=_heavier, factor=_LARGER),
    "in millimetres": _Change(record=lambda record: _times(record, _LARGER), factor=_LARGER, of_angles=False),
    "another seed": _Change(seed=2),
}


@dataclass(frozen=True)
class Config:
    """Kinds of records."""

    records: int = 12
    records_full: int = 40


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record: kinds spread over all that there are, or all of them and the first ones again."""
    wanted = config.records_full if full else config.records
    chosen = np.linspace(0, len(_KINDS) - 1, min(wanted, len(_KINDS))).round().astype(int).tolist()
    again = range(max(wanted - len(_KINDS), 0))
    return [{"kind": _KINDS[i], "replicate": 0} for i in chosen] + [
        {"kind": _KINDS[i], "replicate": 1} for i in again
    ]


def _drawn(kind: str, seed: np.random.SeedSequence) -> tuple[tuple[xr.DataArray, ...], dict[str, float]]:
    """Records of a kind and their system."""
    if kind in _THRESHOLD:
        threshold = _THRESHOLD[kind](kind, seed)
        return threshold.records, dict(threshold.declared)
    sealed = generator.draw(kind.removeprefix("plainly "), seed)
    return (sealed.record,), dict(sealed.system)


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Close the loop on one record, written in several ways."""
    records, declared = _drawn(str(cell["kind"]), seed)
    found: dict[str, Any] = {}
    angular = "inertia" in declared
    for name, change in _CHANGES.items():
        if angular and not change.of_angles:
            found[name] = found[_AS_IT_IS] | {"friction": [math.nan] * 3}
            continue
        system = fb.Oscillator(**change.system(declared))
        report = fb.close_loop(
            [change.record(record) for record in records], system, seed=change.seed
        ).to_dict()
        friction = report["friction_after"]
        found[name] = {
            "verdict": report["verdict"],
            "friction": [friction["mean"] / change.factor, *np.divide(friction["interval90"], change.factor)],
            "sd": friction["sd"] / change.factor,
        }
    usual = found.pop(_AS_IT_IS)
    moved = {name: np.abs(np.subtract(each["friction"], usual["friction"])) for name, each in found.items()}
    return {
        "verdict": usual["verdict"],
        "mean_moves": [float(each[0] / usual["sd"]) for each in moved.values()],
        "end_moves": [float(each[1:].max() / usual["sd"]) for each in moved.values()],
        "same_verdict": [each["verdict"] == usual["verdict"] for each in found.values()],
    }


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Over record and change."""
    names = [name for name in _CHANGES if name != _AS_IT_IS]
    both = ("record", "change")
    # JSON has null for a change that does not apply to the record
    moves = {
        name: (both, np.array([result[name] for result in results], dtype=float))
        for name in ("mean_moves", "end_moves")
    }
    same = (both, np.array([result["same_verdict"] for result in results]))
    return xr.Dataset(
        moves | {"same_verdict": same, "verdict": ("record", [result["verdict"] for result in results])},
        coords={"change": names, "kind": ("record", [str(cell["kind"]) for cell in cells])},
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """How far each change moves friction, and the verdict."""
    table = []
    for name in dataset["change"].values.tolist():
        own = dataset.sel(change=name)
        own = own.isel(record=own["mean_moves"].notnull().values)
        n = own.sizes["record"]
        steady = (own["mean_moves"] < _MEAN_MOVES) & (own["end_moves"] < _END_MOVES)
        turned = own["kind"].values[~own["same_verdict"].values].tolist()
        worst = own["kind"].values[int(np.nanargmax(own["end_moves"].values))]
        text = (
            f"mean moves by {float(own['mean_moves'].median()):.2g} sd (median), "
            f"{float(own['mean_moves'].max()):.2g} (largest); an end by up to "
            f"{float(own['end_moves'].max()):.2g}, in {worst}"
        )
        if turned:
            text += f"; another verdict in {', '.join(turned)}"
        table.append(
            Row(name, f"{int(steady.sum())} of {n} stay, {n - len(turned)} verdicts", f"{n} of {n}", text)
        )
    return table


EXPERIMENT = Experiment(
    name="loop_invariance",
    question="does a report stay what it is where nothing changes but how the record is written?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading=f"target: mean {_MEAN_MOVES:g} sd, ends {_END_MOVES:g} sd",
    group="blind",
)

if __name__ == "__main__":
    main(EXPERIMENT)
