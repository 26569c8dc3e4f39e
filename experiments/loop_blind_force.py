"""Does the loop stay honest where the friction force fluctuates? Sealed records, the force scored apart."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.blind.draws import CONTACT_AND_SENSOR
from experiments.blind.fluctuating import FLUCTUATING_KINDS, draw_fluctuating
from experiments.blind.force_figures import AFTER, BEFORE, by_kind, figure_lines, reliability_lines
from experiments.blind.force_scoring import force_score, other_effects
from experiments.blind.identifiable import IDENTIFIABLE_LOSS
from experiments.blind.oracle import judge
from experiments.blind.scoring import KEPT_CANDIDATES, set_name
from experiments.loop_blind import REFUSED
from experiments.runner import Cell, Experiment, Row, main

__all__ = ["EXPERIMENT"]

RUNS = {BEFORE: "none", AFTER: "auto"}
"""``random_force`` of ``close_loop``."""


_UNBOUNDED = ("loss", "error_before", "error_after", "relative_width", "widths_off")


@dataclass(frozen=True)
class Config:
    """Records a kind with a force, plain ones, and records of the newer kinds without one."""

    records: int = 6
    plain_records: int = 36
    still_records: int = 4
    records_full: int = 60


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record; ``--full`` adds to the records of a default run."""
    wanted = config.records_full if full else config.records
    with_force = [
        {"kind": kind, "fluctuates": True, "replicate": replicate}
        for kind in FLUCTUATING_KINDS
        for replicate in range(max(config.plain_records, wanted) if kind == "plain_coulomb" else wanted)
    ]
    return with_force + [
        {"kind": kind, "fluctuates": False, "replicate": replicate}
        for kind in CONTACT_AND_SENSOR
        for replicate in range(config.still_records)
    ]


def _closed(
    sealed_record: xr.DataArray, system: Mapping[str, float], seed: int, force: str
) -> dict[str, Any]:
    try:
        return fb.close_loop(
            [sealed_record], fb.Oscillator(**system), seed=seed, random_force=force, check=False
        ).to_dict()
    except fb.InputError:
        return REFUSED | {"random_force": None, "held_out_error": None}


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw, close the loop twice on nothing but record and system, then open the seal."""
    seed_of_record, seed_of_loop = seed.spawn(2)
    sealed = draw_fluctuating(cell["kind"], seed_of_record, with_force=cell["fluctuates"])
    number = int(seed_of_loop.generate_state(1)[0])
    truth, judged = sealed.truth, judge(sealed)
    result: dict[str, Any] = {
        "others": set_name(other_effects(truth)),
        "outside": truth.outside,
        "quantity": truth.quantity,
        "snr_db": truth.snr_db,
        "half_cycles": truth.half_cycles,
        "samples_per_period": truth.samples_per_period,
        "force_over_friction": truth.parameters.get("force_over_friction", 0.0),
        "correlation_periods": truth.parameters.get("force_correlation_time", math.nan) / (2.0 * math.pi),
        "loss": judged.loss,
        "rival": set_name(sorted(judged.rival)),
        "identifiable": bool(other_effects(truth)) and not truth.outside and judged.loss >= IDENTIFIABLE_LOSS,
        "force_loss": judged.force_loss,
        "friction_sd": judged.friction_sd,
        "truth": json.dumps(truth.to_dict()),
    }
    for name, force in RUNS.items():
        busy = time.process_time()
        report = _closed(sealed.record, sealed.system, number, force)
        # processor time, so that a busy machine does not count
        elapsed = time.process_time() - busy
        scored = force_score(truth, report) | {"elapsed": elapsed}
        result |= {f"{name}_{key}": value for key, value in scored.items()}
    return result


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a record; what a report does not give is NaN."""
    columns: dict[str, Any] = {
        "kind": ("record", [str(cell["kind"]) for cell in cells]),
        "fluctuates": ("record", [bool(cell["fluctuates"]) for cell in cells]),
        "replicate": ("record", [int(cell["replicate"]) for cell in cells]),
    }
    for name in results[0]:
        values = [result[name] for result in results]
        if name.endswith("_probabilities"):
            padded = np.full((len(values), KEPT_CANDIDATES), np.nan)
            for row, stated in zip(padded, values, strict=True):
                row[: len(stated)] = stated
            columns[name] = (("record", "candidate"), padded)
        elif any(isinstance(value, str) for value in values):
            columns[name] = ("record", values)
        else:
            # JSON has no infinity: an error or a loss without bound, and a figure that is not there
            null = math.inf if name.endswith(_UNBOUNDED) else math.nan
            columns[name] = ("record", [null if value is None else value for value in values])
    return xr.Dataset(columns)


def rows(dataset: xr.Dataset) -> list[Row]:
    """The figures with a random force evaluated, with those of sensor noise alone in the remark."""
    figures = [
        Row(line.what, line.after, line.target, f"{line.before} with sensor noise alone; {line.n} records")
        for line in figure_lines(dataset)
    ]
    return figures + [Row(*line) for line in reliability_lines(dataset)]


EXPERIMENT = Experiment(
    name="loop_blind_force",
    question="does the loop stay honest where the friction force fluctuates?",
    config=Config(),
    cells=cells,
    run=run,
    assemble=assemble,
    rows=rows,
    details=by_kind,
    heading="target",
    group="blind",
)

if __name__ == "__main__":
    main(EXPERIMENT)
