"""Calibration of the sampler's posterior under a random force, all parameters drawn from their priors.

``python -m benchmarks.sampler_calibration [--records N] [--seed S]`` prints p-values of the tests of each
parameter's ranks. Start, friction, rest position, noise, size and correlation time of the force are drawn, a
small record is drawn with them, and emcee samples its posterior; the rank of the truth among nearly
independent draws is uniform. Given size and correlation time, the closed form itself is tested in
``tests/statistical/test_random_force_calibration.py``, on a simulator that shares no code with the filter.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np
from scipy import stats

from friction_bayes.conjugate.likelihood import Target
from friction_bayes.core.arrays import Array
from friction_bayes.reference.ensembles import Ensembles
from friction_bayes.statespace.force_prior import ForcePrior
from friction_bayes.statespace.kalman import Clock, sensor_row
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.sampling.law_target import law_target
from friction_bayes.statespace.sampling.replication import drawn_fluctuation
from friction_bayes.statespace.smoother import SmoothedMotion
from friction_bayes.statespace.transition import initial_response
from friction_bayes.validation.calibration import rank_pit, uniformity

SAMPLES = 120
SCALE = np.array([30.0, 30.0, 0.5, 1.0])
"""Prior sd of start, friction and rest position, in units of the noise."""
LOG_VARIANCE_SD = 0.5
"""The prior of the noise is improper; here it is made proper, in target and draws alike."""
FORCE = ForcePrior(centre=0.5, none=0.5)
STEPS = 250
FALSE_ALARM_RATE = 0.01


def regression_of(signal: Array) -> LawRegression:
    """A record of displacement on the columns of a plain law along a known motion."""
    phase = np.arange(SAMPLES) * 0.3
    amplitude = 100.0 - 0.5 * phase
    x, v = amplitude * np.cos(phase), -amplitude * np.sin(phase)
    path = MeasuredPath.through(phase, x, v)
    states = force_response(path, -path.direction[:, None])
    row, start = sensor_row(0), initial_response(phase)
    columns = np.column_stack([at_sensor(start, row), at_sensor(states, row), np.ones(SAMPLES)])
    return LawRegression(
        clock=Clock.of(phase),
        row=row,
        names=("displacement", "velocity", "friction", "rest"),
        columns=columns,
        states=np.concatenate([start, states, np.zeros((SAMPLES, 2, 1))], axis=2),
        known_states=np.zeros((SAMPLES, 2)),
        target=signal,
        scale=SCALE,
        positive=np.arange(4) == 2,
        sets=np.ones((1, 4), np.bool_),
        log_prior=np.zeros(1),
        stiffness=0,
        motion=SmoothedMotion(
            states=np.column_stack([x, v, np.zeros(SAMPLES)]),
            covariance=np.zeros((SAMPLES, 3, 3)),
            noise=1.0,
            force_sd=FORCE.centre,
            tau=1.0,
        ),
    )


def proper_target(regression: LawRegression) -> Target:
    """The sampler's target with a proper prior of the noise."""
    target = law_target(
        Problem.of(regression),
        FORCE,
        natural=lambda law, noise, q, tau: {"friction": law[:, 2]},
        signals=[regression.target],
        unit=1.0,
    )

    def log_prob(theta: Array) -> Array:
        return target.log_prob(theta) + stats.norm.logpdf(theta[:, -3], 0.0, LOG_VARIANCE_SD)

    return replace(target, log_prob=log_prob)


def ranks(rng: np.random.Generator, seed: int) -> Array:
    """Rank of the truth in one record, of each coordinate."""
    law = SCALE * rng.standard_normal(4)
    law[2] = abs(law[2])
    log_variance = LOG_VARIANCE_SD * rng.standard_normal()
    log_q = math.log(FORCE.centre) + FORCE.spread * rng.standard_normal()
    log_tau = rng.uniform(math.log(FORCE.tau_low), math.log(FORCE.tau_high))
    empty = regression_of(np.zeros(SAMPLES))
    force = math.exp(log_q) * drawn_fluctuation(empty.clock, math.exp(log_tau), rng) @ empty.row
    noise = math.exp(0.5 * log_variance) * rng.standard_normal(SAMPLES)
    regression = regression_of(empty.columns @ law + force + noise)
    run = Ensembles(proper_target(regression), seed=seed, ensembles=4, walkers=32)
    run.advance(STEPS)
    last = run.coordinates(STEPS - 1)[:, -1, :].T
    return np.asarray(rank_pit(last, np.array([*law, log_variance, log_q, log_tau]), run.rng))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    pit = np.array([ranks(rng, arguments.seed + i) for i in range(arguments.records)])
    found = uniformity(pit, false_alarm_rate=FALSE_ALARM_RATE, seed=arguments.seed)
    names = (
        "displacement",
        "velocity",
        "friction",
        "rest",
        "log_variance",
        "log_force_sd",
        "log_correlation_time",
    )
    each = len(found.checks) // len(names)
    for i, name in enumerate(names):
        checks = found.checks[i * each : (i + 1) * each]
        print(
            f"{name:22s} mean rank {pit[:, i].mean():.3f}  " + "  ".join(f"p {c.p_value:.3f}" for c in checks)
        )
    print(f"calibrated: {found.calibrated} (false-alarm rate {FALSE_ALARM_RATE:g}, {len(pit)} records)")


if __name__ == "__main__":
    main()
