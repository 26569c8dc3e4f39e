"""First use of the kernels in two shares, for the workers of a parallel run.

All workers collect, and so begin, with the same kernels. From an empty cache each would compile all of them;
with a share each, one compiles what the other loads. What both need before they can go on is compiled by one
while the other compiles what needs none of it, and is waited for.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

import friction_bayes as fb
from decays import SYSTEM, fluctuating_friction, short_decay
from friction_bayes.statespace.kalman import Clock, sensor_row, whiten
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.smoother import first_motion
from friction_bayes.statespace.subset_evidence import evaluate_sets

__all__ = ["use_kernels"]

_LONGEST = 300.0
"""Seconds after which a worker that does not come is not waited for."""


def use_kernels(worker: int, run: str) -> None:
    """Call what compiles the share of a worker of a run: the fit of one record and of many, or all the rest.

    No test begins before all workers have collected.
    """
    record = short_decay()
    if worker % 2 == 0:
        fb.estimate(record, SYSTEM, random_force="none")
        _done("fit", run)
        fb.estimate_batch(record.expand_dims("machine"), SYSTEM, random_force="none")
        return
    short_decay(effects={"viscous_damping.damping_ratio": 0.01})
    _smooth_and_evaluate()
    _wait_for("fit", run)
    fb.estimate(short_decay(effects=fluctuating_friction()), SYSTEM)
    fb.estimate(record, SYSTEM)
    fb.estimate(record, SYSTEM, method="normal-gamma")
    fb.estimate_batch(record.expand_dims("machine"), SYSTEM)


def _mark(part: str, run: str) -> Path:
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"{run}.{part}"


def _done(part: str, run: str) -> None:
    _mark(part, run).touch()


def _wait_for(part: str, run: str) -> None:
    until = time.monotonic() + _LONGEST
    while not _mark(part, run).exists() and time.monotonic() < until:
        time.sleep(0.1)


def _smooth_and_evaluate() -> None:
    """Call the filter, the path with its response, and the sets of columns."""
    phase = np.arange(0.0, 20.0, 0.1)
    signal = np.cos(phase) * (1.0 - 0.02 * phase)
    row, clock = sensor_row(0), Clock.of(phase)
    motion = first_motion(signal, clock, row)
    x, v = motion.states[:, :2].T.copy()
    path = MeasuredPath.through(phase, x, v, motion.velocity_sd)
    states = force_response(path, -path.direction[:, None])
    friction = at_sensor(states, row, -path.expected_direction[:, None])
    columns = np.column_stack([np.cos(phase), np.sin(phase), friction, signal])
    positive = np.array([False, False, True])
    sets = np.array([[True, True, False], [True, True, True]])
    evaluate_sets(whiten(columns, clock, row, 0.5, 1.0), np.zeros(3), positive, sets, np.zeros(len(sets)))
