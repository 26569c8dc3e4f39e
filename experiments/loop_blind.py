"""Does the loop find what nobody declared? Sealed records, scored against their truth."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

import friction_bayes as fb
from experiments.blind.draws import CATALOGUE
from experiments.blind.figures_of_merit import Figure, common_traits, figures_of_merit, reliability
from experiments.blind.generator import KINDS, PAIR_KINDS
from experiments.blind.identifiable import IDENTIFIABLE_LOSS, sealed_record
from experiments.blind.scoring import KEPT_CANDIDATES, score, set_name
from experiments.runner import Cell, Experiment, Row, main

__all__ = ["EXPERIMENT"]


REFUSED: dict[str, Any] = {
    "verdict": "refused",
    "candidates": [{"effects": ["refused"], "probability": 1.0}],
    "friction_before": None,
    "friction_after": None,
}
"""A record that the loop would not take counts as wrong in every figure."""


@dataclass(frozen=True)
class Config:
    """Records a kind; plain Coulomb records measure a small rate and are always many."""

    records: int = 20
    records_full: int = 200
    plain_records: int = 200


def cells(config: Config, full: bool) -> list[Cell]:
    """One cell a record; ``--full`` adds to the records of a default run."""
    wanted = config.records_full if full else config.records
    return [
        {"kind": kind, "replicate": replicate}
        for kind in KINDS
        for replicate in range(config.plain_records if kind == "plain_coulomb" else wanted)
    ]


def run(config: Config, cell: Cell, seed: np.random.SeedSequence) -> dict[str, Any]:
    """Draw, close the loop on nothing but record and system, then open the seal."""
    seed_of_record, seed_of_loop = seed.spawn(2)
    started = time.perf_counter()
    sealed, loss, rival = sealed_record(cell["kind"], seed_of_record)
    drawn, busy = time.perf_counter(), time.process_time()
    try:
        report = fb.close_loop(
            [sealed.record],
            fb.Oscillator(**sealed.system),
            seed=int(seed_of_loop.generate_state(1)[0]),
            check=False,
        ).to_dict()
    except fb.InputError:
        report = REFUSED
    # processor time, so that a busy machine does not count
    elapsed = time.process_time() - busy
    truth = sealed.truth
    return score(truth.visible, truth.friction, report) | {
        "effects": set_name(truth.effects),
        "visible": set_name(truth.visible),
        "outside": truth.outside,
        "quantity": truth.quantity,
        "snr_db": truth.snr_db,
        "half_cycles": truth.half_cycles,
        "samples_per_period": truth.samples_per_period,
        "mid_motion": truth.mid_motion,
        "reaches_rest": truth.reaches_rest,
        "truth": json.dumps(truth.to_dict()),
        "loss": loss,
        "rival": set_name(sorted(rival)),
        "identifiable": bool(truth.visible) and not truth.outside and loss >= IDENTIFIABLE_LOSS,
        "elapsed": elapsed,
        "elapsed_drawing": drawn - started,
    }


def assemble(cells: Sequence[Cell], results: Sequence[dict[str, Any]]) -> xr.Dataset:
    """One entry a record; a loss of null is that of a record without rivals."""
    columns: dict[str, Any] = {"kind": ("record", [str(cell["kind"]) for cell in cells])}
    columns["replicate"] = ("record", [int(cell["replicate"]) for cell in cells])
    for name in results[0]:
        values = [result[name] for result in results]
        if name == "probabilities":
            padded = np.full((len(values), KEPT_CANDIDATES), np.nan)
            for row, stated in zip(padded, values, strict=True):
                row[: len(stated)] = stated
            columns[name] = (("record", "candidate"), padded)
        else:
            columns[name] = ("record", [math.inf if value is None else value for value in values])
    dataset = xr.Dataset(columns)
    diagram = reliability(dataset, ~dataset["outside"].values.astype(bool))
    return dataset.merge(diagram.rename({name: f"reliability_{name}" for name in diagram.variables}))


def _shown(figure: Figure) -> str:
    if figure.target.endswith("%"):
        return f"{100.0 * figure.value:.2f} ± {100.0 * figure.error:.2f} %"
    return f"{figure.value:.3g} ± {figure.error:.2g}"


def _story(dataset: xr.Dataset, index: int) -> Row:
    """One failure in one line."""
    record = dataset.isel(record=index)
    where = f"{record['quantity'].item()}, {record['kind'].item()} {record['replicate'].item()}"
    return Row(
        f"failed: {record['effects'].item()} in {where}",
        f"{record['verdict'].item()}: {record['said'].item()} {record['said_probability'].item():.2f}, "
        f"friction off {100.0 * record['error_after'].item():.2g} %",
        f"{record['snr_db'].item():.0f} dB, {record['half_cycles'].item()} half cycles",
        f"closest rival {record['rival'].item()} loses {record['loss'].item():.3g}",
    )


def rows(dataset: xr.Dataset) -> list[Row]:
    """The figures, what their failures have in common, the reliability diagram, and every wrong verdict."""
    table: list[Row] = []
    merits = figures_of_merit(dataset)
    for figure in merits:
        reached = "reached" if figure.reached else "missed"
        table.append(Row(figure.name, _shown(figure), figure.target, f"{reached}, {figure.n} records"))
        for trait, failed, total in common_traits(dataset, figure)[:3]:
            table.append(Row("", "", "", f"worse where: {trait} ({failed} of {total})"))
    for b in range(dataset.sizes["bin"]):
        entry = dataset.isel(bin=b)
        if entry["reliability_n"].item():
            table.append(
                Row(
                    f"stated {entry['reliability_low'].item():g} .. {entry['reliability_high'].item():g}",
                    f"true in {entry['reliability_frequency'].item():.3f}",
                    f"{entry['reliability_stated'].item():.3f}",
                    f"z {entry['reliability_z'].item():.1f}, {entry['reliability_n'].item()} candidates",
                )
            )
    for kind in sorted(set(dataset["kind"].values.tolist()), key=KINDS.index):
        mine = dataset["kind"].values == kind
        share = dataset["identifiable"].values[mine].mean()
        right, held = dataset["right"].values[mine].mean(), dataset["held"].values[mine].mean()
        before = 100.0 * np.median(dataset["error_before"].values[mine])
        after = 100.0 * np.median(dataset["error_after"].values[mine])
        verdicts = dataset["verdict"].values[mine]
        counted = ", ".join(f"{name} {np.sum(verdicts == name)}" for name in np.unique(verdicts))
        table.append(
            Row(
                f"{kind}: most probable {right:.0%}, within the 95 % {held:.0%}",
                f"friction off {before:.2g} % before, {after:.2g} % after",
                "",
                f"identifiable {share:.0%}; {counted}" if kind in (*CATALOGUE, *PAIR_KINDS) else counted,
            )
        )
    wrong = np.zeros(dataset.sizes["record"], dtype=bool)
    for figure in (merits[0], merits[1], merits[6], merits[7]):
        wrong |= figure.failed
    return table + [_story(dataset, int(index)) for index in np.flatnonzero(wrong)]


EXPERIMENT = Experiment(
    name="loop_blind",
    question="does the loop find effects that nobody declared, and say so when it cannot?",
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
