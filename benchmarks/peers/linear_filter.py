"""The log-likelihood of a linear model: an oscillator under an Ornstein-Uhlenbeck force, read with noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from statistics import median
from typing import Any

import numpy as np

from benchmarks.peers.measuring import bold, cold, over, table, timed
from friction_bayes.core.arrays import Array
from friction_bayes.statespace.kalman import Clock, colour, sensor_row, whiten
from friction_bayes.statespace.transition import transition_table

PACKAGES = ("statsmodels", "dynamax", "jax", "numba", "numpy")
SAMPLES = 10_000
STEP, RATIO, TAU, NOISE = 0.05, 0.3, 1.5, 2.0
"""Phase from sample to sample, force over noise, correlation time as a phase, and noise."""
ROUNDS = 20


@cache
def data() -> Array:
    """A record of this very model."""
    white = NOISE * np.random.default_rng(1).standard_normal((SAMPLES, 1))
    return colour(white, _clock(), sensor_row(0), RATIO, TAU)[:, 0]


@cache
def _clock() -> Clock:
    return Clock.of(STEP * np.arange(SAMPLES))


def _matrices() -> tuple[Array, Array, Array]:
    """Transition, covariance of the step and that of the start, in the unit of the data."""
    (transition,), (added,) = transition_table(np.array([STEP]), np.ones(1), TAU)
    square = (RATIO * NOISE) ** 2
    return transition, square * added, np.diag([0.0, 0.0, square])


def ours(samples: int = SAMPLES) -> float:
    """The package's kernel on the first samples, the clock prepared anew each time."""
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
    model["design"], model["obs_cov"] = sensor_row(0)[None], np.array([[NOISE**2]])
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
    params = make_lgssm_params(
        np.zeros(3), start, transition, added, sensor_row(0)[None], np.array([[NOISE**2]])
    )
    return jax.jit(lambda emissions: lgssm_filter(params, emissions).marginal_loglik)


def dynamax_filter() -> float:
    """The filter of dynamax in double precision, compiled once."""
    return float(_compiled()(data()[:, None]))


FILTERS: dict[str, Callable[[], float]] = {
    "ours": ours,
    "statsmodels": statsmodels_filter,
    "dynamax": dynamax_filter,
}


def first_runs() -> dict[str, Callable[[], float]]:
    """By contestant, what its first run gives."""
    return FILTERS


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
        ratio = over(times[name], times["ours"])
        rows.append(
            [
                name,
                f"{values[name]:.6f}",
                f"{abs(values[name] / values['ours'] - 1.0):.0e}",
                bold(f"{first[name]:.1f}", first[name] < first["ours"]),
                bold(f"{1e3 * median(times[name]):.2f}", ratio < 1.0),
                bold(f"{ratio:.1f}", ratio < 1.0),
            ]
        )
    headings = ["filter", "log-likelihood", "relative difference", "cold [s]", "warm [ms]", "warm, over ours"]
    return table(headings, rows)
