"""The loop on ordinary records."""

from __future__ import annotations

import numpy as np

from experiments.loop_ordinary import EXPERIMENT, assemble, details, rows, run


def test_a_row_tells_what_was_refused_and_what_was_covered() -> None:
    wanted = [{"row": row, "replicate": 0} for row in ("short and clean", "steady drive alone")]
    seeds = np.random.SeedSequence(5).spawn(len(wanted))
    results = [run(EXPERIMENT.config, cell, seed) for cell, seed in zip(wanted, seeds, strict=True)]
    dataset = assemble(wanted, results)
    clean, drive = details(dataset)
    assert (clean["refused"], drive["refused"]) == ("0", "1")
    assert sum(int(clean[word]) for word in ("adequate", "explained", "ambiguous", "unexplained")) == 1
    assert clean["covered"] in ("0 of 1", "1 of 1")
    assert drive["covered"] == ""
    assert abs(float(clean["friction / truth"]) - 1.0) < 0.1
    reported = {row.what: row.ours for row in rows(dataset)}
    assert reported["refused"] == "1"


def test_each_sensor_has_as_many_records() -> None:
    replicates = {cell["replicate"] for cell in EXPERIMENT.cells(EXPERIMENT.config, False)}
    assert len(replicates) == EXPERIMENT.config.records
    assert len(replicates) % 3 == 0
