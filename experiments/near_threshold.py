"""Is a verdict to be trusted where an effect is small, or one that the catalogue lacks? Sealed records."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.blind.misleading_records import MISLEADING, draw_misleading
from experiments.blind.near_threshold import FRICTION, KINDS, draw_near_threshold
from experiments.blind.scoring import set_name, widths_off
from experiments.method_tables import share_error, with_error
from experiments.runner import Cell, Experiment, Row, main

__all__ = ["EXPERIMENT"]

_KINDS = (*KINDS, *MISLEADING)
_TRUSTED = 0.85
"""Share of the intervals that have to cover the true friction, of the verdicts that may be trusted."""
_LEAST_OF_A_KIND = 0.8
"""The same below which a kind is named."""
_MOST_MOVED = 0.5
"""Standard deviations by which priors of another scale may move friction."""
_PRIORS = {"0.1": "narrow", "10": "wide"}
"""Factors on the scale of the priors of effects, and what ten times as much is called."""


@dataclass(frozen=True)
class Config:
    """Records a kind."""

    records: int = 12
    records_full: int = 60


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record."""
    wanted = config.records_full if full else config.records
    return [{"kind": kind, "replicate": replicate} for replicate in range(wanted) for kind in _KINDS]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw, close the loop on nothing but record and system, then open the seal."""
    seed_of_record, seed_of_loop = seed.spawn(2)
    draw = draw_misleading if cell["kind"] in MISLEADING else draw_near_threshold
    sealed = draw(cell["kind"], seed_of_record)
    busy = time.process_time()
    report = fb.close_loop(
        sealed.records,
        fb.Oscillator(**sealed.declared),
        seed=int(seed_of_loop.generate_state(1)[0]),
    ).to_dict()
    # processor time, so that a busy machine does not count
    elapsed = time.process_time() - busy
    low, high = report["friction_after"]["interval90"]
    best = report["candidates"][0]
    return {
        "size": sealed.size,
        "verdict": report["verdict"],
        "said": set_name(best["effects"]),
        "said_probability": best["probability"],
        "mean": report["friction_after"]["mean"] / FRICTION,
        "covered": low <= FRICTION <= high,
        "relative_width": (high - low) / FRICTION,
        "widths_off": widths_off(report["friction_after"], FRICTION),
        **{f"moved_{word}": report["prior_sensitivity"][factor] for factor, word in _PRIORS.items()},
        "elapsed": elapsed,
    }


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a record."""
    columns = {
        "kind": ("record", [str(cell["kind"]) for cell in cells]),
        "replicate": ("record", [int(cell["replicate"]) for cell in cells]),
    }
    # JSON has no infinity: an estimate without an interval is any number of widths off, and the
    # effect of priors of another scale is unknown where the posterior would lie elsewhere
    return xr.Dataset(
        columns
        | {
            name: ("record", [math.inf if result[name] is None else result[name] for result in results])
            for name in results[0]
        }
    )


def _trusted(records: xr.Dataset) -> xr.Dataset:
    """Those with a verdict that may be trusted."""
    return records.isel(record=(records["verdict"] != "unexplained").values)


def _row(what: str, records: xr.Dataset) -> Row:
    """Of the verdicts that may be trusted."""
    trusted = _trusted(records)
    n = trusted.sizes["record"]
    counted = f"{n} of {records.sizes['record']} trusted"
    if n == 0:
        return Row(what, "none trusted", f">= {_TRUSTED:.0%}", counted)
    words, counts = np.unique(records["verdict"], return_counts=True)
    verdicts = ", ".join(f"{word} {count}" for word, count in zip(words, counts, strict=True))
    return _coverage(what, trusted, f"{counted} ({verdicts})")


def _coverage(what: str, records: xr.Dataset, counted: str, target: str = f">= {_TRUSTED:.0%}") -> Row:
    gross = int(np.sum(records["widths_off"] > 1.0))
    width = 100.0 * float(records["relative_width"].median())
    return Row(
        what,
        f"covers {_share(records['covered'])}",
        target,
        f"{counted}; {gross} a whole width off; median width {width:.2g} %",
    )


def _share(which: xr.DataArray) -> str:
    rate, error = share_error(which)
    return f"{with_error(100.0 * rate, 100.0 * error)} %"


def _over_all_kinds(records: xr.Dataset) -> list[Row]:
    """Figures and targets of all verdicts that may be trusted together."""
    trusted = _trusted(records)
    n = f"{trusted.sizes['record']} records"
    covered = {
        kind: float(trusted["covered"].isel(record=(trusted["kind"] == kind).values).mean())
        for kind in _KINDS
    }
    low = [f"{kind} {rate:.0%}" for kind, rate in covered.items() if rate < _LEAST_OF_A_KIND]
    return [
        _coverage("all kinds, trusted", trusted, n, "87 .. 94 %"),
        Row(f"kinds covered less than {_LEAST_OF_A_KIND:.0%}", str(len(low)), "0", ", ".join(low)),
        Row("truth more than a whole width off", _share(trusted["widths_off"] > 1.0), "<= 2 %", n),
        Row(
            "verdict other than unexplained",
            _share(records["verdict"] != "unexplained"),
            ">= 80 %",
            f"{records.sizes['record']} records",
        ),
        *(_moved(trusted, word) for word in _PRIORS.values()),
    ]


def _moved(records: xr.Dataset, word: str) -> Row:
    """How far friction depends on the scale of the priors."""
    shift = np.abs(records[f"moved_{word}"])
    known = shift[np.isfinite(shift)]
    return Row(
        f"friction moves by less than {_MOST_MOVED:g} sd with priors of effects ten times as {word}",
        _share(known < _MOST_MOVED),
        "100 %",
        f"{known.size} records, largest {float(known.max()):.2g} sd; unknown in {shift.size - known.size}",
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """Of the verdicts other than ``unexplained``, how many intervals cover the true friction, by kind."""
    table = [_row(kind, dataset.isel(record=(dataset["kind"] == kind).values)) for kind in _KINDS]
    seconds = float(dataset["elapsed"].median())
    unexplained = dataset.isel(record=(dataset["verdict"] == "unexplained").values)
    if unexplained.sizes["record"]:
        table.append(
            _coverage("unexplained, as reported", unexplained, f"{unexplained.sizes['record']} records")
        )
    return [*table, *_over_all_kinds(dataset), Row("time a record", f"{seconds:.2g} s", "", "median")]


EXPERIMENT = Experiment(
    name="near_threshold",
    question="is a verdict to be trusted where an effect is small, or one that the catalogue lacks?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    heading="target",
    group="blind",
)

if __name__ == "__main__":
    main(EXPERIMENT)
