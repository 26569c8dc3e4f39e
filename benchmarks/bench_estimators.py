"""Time and accuracy of the estimators, side by side, on the paper's numerical example.

Ratios are of two times taken alternately in one run, so that they mean the same on a busy machine.
"""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from friction_bayes import estimate, estimate_batch, sample_reference
from friction_bayes.mechanics.simulate import simulate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM, paper_example

METHODS = ["normal-gamma", "gamma-exponential", "envelope", "waveform"]
SEEDS = range(20)
RECORDS = 50


def ratio(slow: Callable[[], Any], fast: Callable[[], Any], repeats: int = 5) -> float:
    """Median of the ratios of paired times."""
    pairs = []
    for _ in range(repeats):
        started = perf_counter()
        slow()
        between = perf_counter()
        fast()
        pairs.append((between - started) / (perf_counter() - between))
    return median(pairs)


class Estimators:
    """One record of 33,000 samples, by method."""

    params = (METHODS,)
    param_names = ("method",)
    timeout = 300

    def setup(self, method):
        self.record = paper_example(seed=1)
        estimate(self.record, PAPER_SYSTEM, method=method)

    def time_estimate(self, method):
        estimate(self.record, PAPER_SYSTEM, method=method)

    def track_sampler_over_closed_form(self, method):
        """Wall time of the emcee reference over that of the closed form."""
        tree = sample_reference(self.record, PAPER_SYSTEM, method=method, seed=1)
        return tree.attrs["wall_time_s"] / tree.attrs["closed_form_wall_time_s"]

    def track_rms_error(self, method):
        """Root mean square of the relative friction error over twenty synthetic records."""
        records = [paper_example(seed=seed) for seed in SEEDS]
        friction = records[0].attrs["friction"]
        errors = [estimate(r, PAPER_SYSTEM, method=method).friction.mean() / friction - 1.0 for r in records]
        return float(np.sqrt(np.mean(np.square(errors))))

    def track_interval_width(self, method):
        """Median width of the 90 % interval over the friction."""
        records = [paper_example(seed=seed) for seed in SEEDS]
        intervals = [estimate(r, PAPER_SYSTEM, method=method).friction.interval(0.9) for r in records]
        return float(np.median(np.diff(intervals, axis=1)) / records[0].attrs["friction"])


class Batch:
    """Many records at once against one after the other."""

    timeout = 300

    def setup(self):
        self.record = simulate(
            PAPER_SYSTEM,
            friction=PAPER_FRICTION,
            initial_displacement=PAPER_RELEASE,
            duration=10.0,
            sampling_rate=200.0,
            noise_sd=5e-4,
            seed=1,
        )
        self.stack = np.tile(self.record.values, (RECORDS, 1))
        self.batch()
        self.one_by_one()

    def batch(self):
        return estimate_batch(self.stack, PAPER_SYSTEM, sampling_rate=200.0)

    def one_by_one(self):
        return [estimate(self.record, PAPER_SYSTEM) for _ in range(RECORDS)]

    def time_batch(self):
        self.batch()

    def track_one_by_one_over_batch(self):
        """How many times faster the batch is on one core."""
        return ratio(self.one_by_one, self.batch)
