"""Draws of a motion under a random force and of a sensor's noise: the model of the filter, run forward."""

from __future__ import annotations

import math

import numpy as np

from friction_bayes.core.arrays import Array, Indices
from friction_bayes.core.kernels import KERNEL, njit
from friction_bayes.statespace.kalman import Clock
from friction_bayes.statespace.transition import transition_table

__all__ = ["drawn_fluctuation", "drawn_noise"]


def drawn_fluctuation(clock: Clock, tau: float, rng: np.random.Generator) -> Array:
    """Displacement, velocity and force, shape (n, 3), of an oscillator at rest under a force of unit sd.

    Parameters
    ----------
    clock : Clock
        Time stamps.
    tau : float
        Correlation time of the force, a phase.
    rng : numpy.random.Generator
    """
    transitions, covariances = transition_table(clock.steps, clock.stiffness, tau)
    return _run(clock.index, transitions, covariances, rng.standard_normal((clock.phase.size, 3)))


def drawn_noise(clock: Clock, rng: np.random.Generator) -> Array:
    """Noise of the sensor for ``sigma = 1``, shape (n,); samples that are not used have unit variance.

    Parameters
    ----------
    clock : Clock
        Time stamps, with the variances and the correlated error of the sensor.
    rng : numpy.random.Generator
    """
    n = clock.phase.size
    if clock.autoregression is not None:
        return clock.autoregression.drawn(n, rng) + np.sqrt(
            np.where(clock.used, clock.variance - 1.0, 0.0)
        ) * rng.standard_normal(n)
    noise = np.sqrt(np.where(clock.used, clock.variance, 1.0)) * rng.standard_normal(n)
    if clock.error.ratio == 0.0:
        return np.asarray(noise)
    steps = clock.error_steps
    kicks = rng.standard_normal(n)
    error = clock.error.ratio * kicks[0]
    noise[0] += error
    for i, k in enumerate(clock.index, start=1):
        error = steps.decays[k] * error + math.sqrt(steps.added[k]) * kicks[i]
        noise[i] += error
    return np.asarray(noise)


@njit(**KERNEL)
def _run(index: Indices, transitions: Array, covariances: Array, normal: Array) -> Array:
    roots = np.zeros_like(covariances)
    for k in range(len(covariances)):
        c, root = covariances[k], roots[k]
        # a short step moves displacement, velocity and force as one: rounding must not leave a negative rest
        for i in range(3):
            for j in range(i + 1):
                rest = c[i, j]
                for m in range(j):
                    rest -= root[i, m] * root[j, m]
                if i == j:
                    root[i, i] = math.sqrt(max(rest, 0.0))
                elif root[j, j] > 0.0:
                    root[i, j] = rest / root[j, j]
    states = np.zeros_like(normal)
    states[0, 2] = normal[0, 2]
    for i in range(1, len(normal)):
        f, root = transitions[index[i - 1]], roots[index[i - 1]]
        for a in range(3):
            for b in range(3):
                states[i, a] += f[a, b] * states[i - 1, b] + root[a, b] * normal[i, b]
    return states
