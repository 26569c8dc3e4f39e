"""The filter knows what the forces of a law make of a perturbation."""

from __future__ import annotations

import numpy as np
import pytest

from friction_bayes.statespace.kalman import Clock, sensor_row, whiten
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.response import Feedback, feedback_steps, force_response

N = 60


def dense_covariance(clock: Clock, row: np.ndarray, ratio: float, tau: float) -> np.ndarray:
    """Covariance of the samples of a force and unit noise, state by state."""
    steps = clock.forced_steps(ratio, tau)
    covariance = np.zeros((3, 3))
    covariance[2, 2] = steps.square
    found = np.eye(clock.phase.size)
    for i in range(clock.phase.size):
        across = covariance
        found[i, i] += row @ across @ row
        for j in range(i + 1, clock.phase.size):
            across = steps.transitions[steps.step[j - 1]] @ across
            found[i, j] = found[j, i] = row @ across @ row
        if i < clock.phase.size - 1:
            f = steps.transitions[steps.step[i]]
            covariance = f @ covariance @ f.T + steps.added[steps.step[i]]
    return found


@pytest.mark.parametrize("order", [0, 1, 2])
def test_whitening_with_a_law_is_dense_algebra(order: int, rng: np.random.Generator) -> None:
    feedback = np.tile(np.eye(2), (N - 1, 1, 1))
    feedback[10] = [[1.0, 0.0], [0.0, 0.6]]
    feedback[30] = [[1.01, 0.02], [-0.1, 0.8]]
    clock, row = Clock.of(0.2 * np.arange(N), feedback=feedback), sensor_row(order)
    block = rng.standard_normal((N, 2))
    found = whiten(block, clock, row, 3.0, 0.7)
    covariance = dense_covariance(clock, row, 3.0, 0.7)
    np.testing.assert_allclose(found.gram, block.T @ np.linalg.solve(covariance, block), rtol=1e-10)
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-12)
    without = whiten(block, Clock.of(clock.phase), row, 3.0, 0.7)
    assert abs(found.log_determinant - without.log_determinant) > 0.1


def test_intervals_one_after_another_make_the_whole_answer(rng: np.random.Generator) -> None:
    phase = 0.25 * np.arange(N)
    path = MeasuredPath.through(phase, np.cos(phase + 0.3), -np.sin(phase + 0.3))
    slopes = 0.1 * rng.standard_normal((path.node_phase.size, 2))
    feedback = Feedback(slopes, np.zeros((N, 2)), rng.uniform(0.3, 0.9, path.turning.size))
    whole = force_response(path, np.zeros((path.node_phase.size, 2)), np.eye(2), feedback)
    clock = Clock.of(phase, feedback=feedback_steps(path, feedback))
    steps = clock.forced_steps(0.0, 1.0)
    state = np.eye(2)
    for i in range(N - 1):
        state = steps.transitions[steps.step[i]][:2, :2] @ state
        np.testing.assert_allclose(state, whole[i + 1], atol=1e-12)
