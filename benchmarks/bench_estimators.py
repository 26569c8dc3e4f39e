"""Time and accuracy of the estimators and the loop, side by side, on the paper's numerical example.

Ratios are of two times taken alternately in one run, so that they mean the same on a busy machine.
"""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.loops import RECORDS, closed
from benchmarks.throughput import batch, over_sum, paper_records, peak_memory, peak_share
from friction_bayes import estimate, estimate_batch, sample_reference
from friction_bayes.mechanics.simulate import simulate
from friction_bayes.mechanics.testbed import PAPER_FRICTION, PAPER_RELEASE, PAPER_SYSTEM, paper_example
from friction_bayes.statespace.force_grid import integrate_force
from friction_bayes.statespace.force_prior import ForcePrior
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.smoother import first_motion
from friction_bayes.statespace.transition import initial_response

METHODS = ["normal-gamma", "gamma-exponential", "envelope", "waveform"]
SEEDS = range(20)
COPIES = 50


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
        started = perf_counter()
        estimate(self.record, PAPER_SYSTEM, method=method)
        return tree.attrs["wall_time_s"] / (perf_counter() - started)

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


class RandomForce:
    """Smoothing of 10,000 samples, and the average over size and correlation time of a random force."""

    timeout = 300

    def setup(self):
        phase = np.arange(10_000) * (2.0 * np.pi / 300.0)
        rng = np.random.default_rng(1)
        self.signal = (1.0 - 0.004 * phase) * np.cos(phase) + 0.01 * rng.standard_normal(phase.size)
        self.clock, self.row = Clock.of(phase), sensor_row(0)
        self.motion = first_motion(self.signal, self.clock, self.row)
        self.time_average()

    def time_first_motion(self):
        first_motion(self.signal, self.clock, self.row)

    def time_average(self):
        x, v, _ = self.motion.states.T
        path = MeasuredPath.through(self.clock.phase, x, v, self.motion.velocity_sd)
        forces = force_response(
            path, np.stack([-path.direction, -path.node_x, 0.0 * path.node_x + 1.0], axis=1)
        )
        columns = at_sensor(np.concatenate([initial_response(path.phase), forces], axis=2), self.row)
        sets = np.ones((1, 5), np.bool_)
        regression = LawRegression(
            clock=self.clock,
            row=self.row,
            names=("x0", "v0", "friction", "stiffness", "rest"),
            columns=columns,
            states=np.zeros((len(columns), 2, 5)),
            known_states=np.zeros((len(columns), 2)),
            target=self.signal,
            scale=np.ones(5),
            positive=np.zeros(5, np.bool_),
            sets=sets,
            log_prior=np.zeros(len(sets)),
            stiffness=3,
            motion=self.motion,
        )
        return integrate_force(Problem.of(regression), ForcePrior(centre=1e-3))


class Loop:
    """The loop on one record, all sets of effects evaluated."""

    params = (list(RECORDS),)
    param_names = ("record",)
    timeout = 300

    def setup(self, record):
        self.given = RECORDS[record]()
        closed(self.given)

    def time_loop(self, record):
        closed(self.given)

    def track_peak_memory(self, record):
        """Most memory in use during the loop, in addition to what was there."""
        return peak_memory(lambda: closed(self.given))

    def track_loop_over_simulation(self, record):
        """Time of the loop over that of making the record."""
        return ratio(lambda: closed(self.given), RECORDS[record])

    def track_friction_error(self, record):
        """Relative error of the mean friction."""
        return closed(self.given).friction_after["mean"] / self.given[2] - 1.0


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
        self.stack = np.tile(self.record.values, (COPIES, 1))
        self.batch()
        self.one_by_one()

    def batch(self):
        return estimate_batch(self.stack, PAPER_SYSTEM, sampling_rate=200.0)

    def one_by_one(self):
        return [estimate(self.record, PAPER_SYSTEM) for _ in range(COPIES)]

    def time_batch(self):
        self.batch()

    def track_one_by_one_over_batch(self):
        """How many times faster the batch is on one core."""
        return ratio(self.one_by_one, self.batch)


class Throughput:
    """What a batch costs over one reading of its samples, checks included; see ``benchmarks.throughput``."""

    timeout = 600

    def setup(self):
        self.records = paper_records(200)

    def track_batch_over_sum(self):
        """Time over that of ``numpy.sum`` over the same array."""
        return over_sum(lambda: batch(self.records), self.records)[0]

    def track_peak_share(self):
        """Most memory in use beyond the records, over theirs."""
        return peak_share(self.records)
