"""The targets of a report where nothing changes but how its record is written."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from experiments import loop_invariance
from experiments.loop_invariance import EXPERIMENT, assemble, rows, run


def test_a_plain_record_stays_what_it_is(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    few = {name: loop_invariance._CHANGES[name] for name in ("as it is", "mirrored", "in grams")}
    monkeypatch.setattr(loop_invariance, "_CHANGES", few)
    cell = {"kind": "plainly plain_coulomb", "replicate": 0}
    dataset = assemble([cell], [run(EXPERIMENT.config, cell, np.random.SeedSequence(seed))])
    assert dataset["same_verdict"].values.all()
    # draws of the posterior differ from seed to seed by some hundredths of an sd
    assert float(dataset["mean_moves"].max()) < 0.1
    assert float(dataset["end_moves"].max()) < 0.25


def test_what_moves_is_counted_and_named() -> None:
    reported = xr.Dataset(
        {
            "mean_moves": (("record", "change"), [[0.01, 0.3], [0.02, 0.0]]),
            "end_moves": (("record", "change"), [[0.1, 0.2], [0.3, 0.0]]),
            "same_verdict": (("record", "change"), [[True, False], [True, True]]),
        },
        coords={"change": ["mirrored", "in grams"], "kind": ("record", ["first", "second"])},
    )
    mirrored, grams = rows(reported)
    assert mirrored.ours == "1 of 2 stay, 2 verdicts"
    assert "in second" in mirrored.remark
    assert grams.ours == "1 of 2 stay, 1 verdicts"
    assert grams.remark.endswith("another verdict in first")
