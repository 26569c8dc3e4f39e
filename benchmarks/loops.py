"""Records to close the loop on, plain and hard, and what that costs: seconds of one thread and memory.

A plain record has viscous damping in addition to friction; hard ones are drawn as in the sealed test: a
spring on one side, and an eccentric encoder under a random force.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import xarray as xr

from benchmarks.throughput import least_times, peak_memory
from experiments.blind.fluctuating import draw_fluctuating
from experiments.blind.generator import draw
from experiments.blind.sealed import SealedRecord
from friction_bayes import LoopReport, Oscillator, close_loop, simulate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM

__all__ = ["RECORDS", "closed", "loops_table", "plain_record"]

DURATION = 20.0
MEGABYTE = 1e6
SEEDS = (1, 2, 3)

Given = tuple[xr.DataArray, Oscillator, float]
"""A record, its system and its friction [N or N m]."""


def plain_record(samples: int) -> Given:
    """The paper's example with viscous damping, for twenty seconds."""
    record = simulate(
        PAPER_SYSTEM,
        friction=PAPER_FRICTION,
        initial_displacement=PAPER_RELEASE,
        duration=DURATION,
        sampling_rate=samples / DURATION,
        noise_sd=2e-4,
        effects={"viscous_damping.damping_ratio": 0.002},
        seed=1,
    )
    return record, PAPER_SYSTEM, PAPER_FRICTION


def _hard_record(drawn: Callable[[str, int], SealedRecord], kind: str, seed: int) -> Given:
    sealed = drawn(kind, seed)
    return sealed.record, Oscillator(**sealed.system), sealed.truth.friction


PLAIN: dict[str, Callable[[], Given]] = {
    f"viscous damping, {n:,} samples": partial(plain_record, n) for n in (2_000, 10_000, 50_000)
}
HARD: dict[str, Callable[[], Given]] = {
    f"{name}, seed {seed}": partial(_hard_record, drawn, kind, seed)
    for name, drawn, kind in (
        ("one-sided spring", draw, "one_sided_spring"),
        ("eccentric encoder, random force", draw_fluctuating, "encoder_eccentricity"),
    )
    for seed in SEEDS
}
RECORDS = PLAIN | HARD
"""By name, what makes a record."""


def closed(given: Given) -> LoopReport:
    """The loop on one record, without the sampler."""
    record, system, _ = given
    return close_loop([record], system, seed=1)


def loops_table() -> list[str]:
    """Processor time of the loop on each record, and the memory that it needs."""
    lines = ["| `close_loop` | samples | s | s per 1,000 | MB | MB per 1,000 |", "|---|---|---|---|---|---|"]
    for name, make in RECORDS.items():
        given = make()

        def loop(given: Given = given) -> Any:
            return closed(given)

        loop()
        (spent,) = least_times([loop], 3)
        memory, samples = peak_memory(loop) / MEGABYTE, given[0].size
        each = f"{spent:.2f} | {1e3 * spent / samples:.2f} | {memory:.0f} | {1e3 * memory / samples:.1f}"
        lines.append(f"| {name} | {samples:,} | {each} |")
    return [*lines, "", "Least of three times; most memory in use, less that before."]
