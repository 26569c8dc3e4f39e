"""The table of records near the threshold: figures and targets of a kind, and of all kinds together."""

from __future__ import annotations

import numpy as np
import xarray as xr

from experiments.blind.misleading_records import MISLEADING
from experiments.blind.near_threshold import KINDS
from experiments.near_threshold import rows

EVERY = (*KINDS, *MISLEADING)


def records() -> xr.Dataset:
    """Ten records a kind; of pairs that cancel three are covered and one is far off."""
    kind = np.repeat(EVERY, 10)
    n = kind.size
    pairs = np.flatnonzero(kind == "cancelling_pair")
    covered, widths = np.ones(n, dtype=bool), np.full(n, 0.2)
    covered[pairs[3:]], widths[pairs[9]] = False, np.inf
    verdict = np.where(np.arange(n) == 0, "unexplained", "adequate")
    wide = np.full(n, 0.1)
    wide[1], wide[2] = -0.7, np.inf
    columns = {
        "kind": kind,
        "verdict": verdict,
        "covered": covered,
        "widths_off": widths,
        "relative_width": np.full(n, 0.05),
        "moved_narrow": np.full(n, -0.2),
        "moved_wide": wide,
        "elapsed": np.full(n, 1.4),
    }
    return xr.Dataset({name: ("record", values) for name, values in columns.items()})


def test_all_kinds_together() -> None:
    reported = {row.what: row for row in rows(records())}
    assert len(EVERY) == 18
    assert reported["cancelling_pair"].ours.startswith("covers 30 ")
    assert reported["kinds covered less than 80%"].ours == "1"
    assert reported["kinds covered less than 80%"].remark == "cancelling_pair 30%"
    # 172 of 179
    assert reported["all kinds, trusted"].ours.startswith("covers 96 ")
    assert reported["truth more than a whole width off"].ours.startswith("0.6 ")
    assert reported["verdict other than unexplained"].ours.startswith("99.4 ")
    narrow, wide = (
        reported[f"friction moves by less than 0.5 sd with priors of effects ten times as {word}"]
        for word in ("narrow", "wide")
    )
    assert narrow.remark == "179 records, largest 0.2 sd; unknown in 0"
    assert wide.ours.startswith("99.4 ")
    assert wide.remark == "178 records, largest 0.7 sd; unknown in 1"
