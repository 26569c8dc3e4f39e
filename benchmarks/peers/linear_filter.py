"""The log-likelihood of a linear model: an oscillator under an Ornstein-Uhlenbeck force, read with noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from statistics import median
from typing import Any

import numpy as np
from scipy.linalg import expm

from benchmarks.peers.measuring import bold, cold, over, table, timed
from friction_bayes.core.arrays import Array

PACKAGES = ("statsmodels", "dynamax", "jax", "numba", "numpy")
SAMPLES = 10_000
STEP, RATIO, TAU, NOISE = 0.05, 0.3, 1.5, 2.0
"""Phase from sample to sample, force over noise, correlation time as a phase, and noise."""
SENSOR = np.array([[1.0, 0.0, 0.0]])
ROUNDS = 20


@cache
def _matrices() -> tuple[Array, Array, Array]:
    """Transition, covariance of the step (van Loan) and of the start, without this package's kernels."""
    square = (RATIO * NOISE) ** 2
    rates = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 1.0], [0.0, 0.0, -1.0 / TAU]])
    driven = np.diag([0.0, 0.0, 2.0 * square / TAU])
    both = expm(STEP * np.block([[-rates, driven], [np.zeros((3, 3)), rates.T]]))
    transition = both[3:, 3:].T
    return transition, transition @ both[:3, 3:], np.diag([0.0, 0.0, square])


@cache
def data() -> Array:
    """A record of this very model."""
    rng = np.random.default_rng(1)
    transition, added, start = _matrices()
    state = rng.multivariate_normal(np.zeros(3), start)
    steps = rng.multivariate_normal(np.zeros(3), added, SAMPLES)
    record = np.empty(SAMPLES)
    for k, step in enumerate(steps):
        record[k] = state[0]
        state = transition @ state + step
    return record + NOISE * rng.standard_normal(SAMPLES)


def ours(samples: int = SAMPLES) -> float:
    """The package's kernel on the first samples, the clock prepared anew each time."""
    from friction_bayes.statespace.kalman import Clock, sensor_row, whiten

    clock = Clock.of(STEP * np.arange(samples))
    whitened = whiten(data()[:samples, None], clock, sensor_row(0), RATIO, TAU)
    constant = whitened.used * math.log(2.0 * math.pi * NOISE**2)
    return -0.5 * (constant + whitened.log_determinant + float(whitened.gram[0, 0]) / NOISE**2)


def statsmodels_filter() -> float:
    """The compiled Kalman filter of statsmodels, keeping the likelihood alone."""
    from statsmodels.tsa.statespace.kalman_filter import MEMORY_CONSERVE, KalmanFilter

    transition, added, start = _matrices()
    model = KalmanFilter(k_endog=1, k_states=3)
    model.bind(data()[:, None])
    model["design"], model["obs_cov"] = SENSOR, np.array([[NOISE**2]])
    model["transition"], model["selection"], model["state_cov"] = transition, np.eye(3), added
    model.initialize_known(np.zeros(3), start)
    model.set_conserve_memory(MEMORY_CONSERVE)
    return float(model.loglike())


@cache
def _compiled() -> Callable[[Any], Any]:
    import jax

    jax.config.update("jax_enable_x64", True)
    from dynamax.linear_gaussian_ssm.inference import lgssm_filter, make_lgssm_params

    transition, added, start = _matrices()
    params = make_lgssm_params(np.zeros(3), start, transition, added, SENSOR, np.array([[NOISE**2]]))
    return jax.jit(lambda emissions: lgssm_filter(params, emissions).marginal_loglik)


def dynamax_filter() -> float:
    """The filter of dynamax in double precision, compiled once."""
    return float(_compiled()(data()[:, None]))


OURS = "ours"
FILTERS: dict[str, Callable[[], float]] = {
    OURS: ours,
    "statsmodels": statsmodels_filter,
    "dynamax": dynamax_filter,
}


def prepared(name: str) -> Callable[[], float]:
    """The first run of a filter, its data ready."""
    data(), _matrices()
    return FILTERS[name]


summary = float


def compare() -> list[str]:
    """The table of the page."""
    first = {name: cold("linear_filter", name)[0] for name in FILTERS}
    values = {name: run() for name, run in FILTERS.items()}
    times: dict[str, list[float]] = {name: [] for name in FILTERS}
    for _ in range(ROUNDS):
        for name, run in FILTERS.items():
            times[name].append(timed(run)[0])
    rows = []
    for name in FILTERS:
        ratio = over(times[name], times[OURS])
        rows.append(
            [
                name,
                f"{values[name]:.6f}",
                f"{abs(values[name] / values[OURS] - 1.0):.0e}",
                bold(f"{first[name]:.1f}", first[name] < first[OURS]),
                bold(f"{1e3 * median(times[name]):.2f}", ratio < 1.0),
                bold(f"{ratio:.1f}", ratio < 1.0),
            ]
        )
    headings = ["filter", "log-likelihood", "relative difference", "cold [s]", "warm [ms]", "warm, over ours"]
    return table(headings, rows)
