"""The regression under a random force, given its size and correlation time, is calibrated.

The records come from a dense covariance by quadrature, which shares no code with the filter. Their noise has
unit sd, which the analyst does not know: its prior is improper, and hundreds of samples determine it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.special import log_ndtr, ndtr

from dense_force import dense_covariance
from friction_bayes import testing
from friction_bayes.statespace.kalman import Clock, sensor_row, whiten
from friction_bayes.statespace.measured_path import MeasuredPath
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.subset_evidence import evaluate_sets, set_marginals, set_posterior
from friction_bayes.statespace.transition import initial_response

RARE = 1e-4
REPLICATIONS = 5_000
"""A bias that 10,000 would show is shown from 1.4 times its size on."""
FEW = 2_000
SAMPLES = 200
FRICTION = 2


def design(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Phase and columns of start, friction and rest along a known motion, times the prior sd of each."""
    phase = np.arange(SAMPLES) * 0.3
    amplitude = 100.0 - 0.5 * phase
    path = MeasuredPath.through(phase, amplitude * np.cos(phase), -amplitude * np.sin(phase))
    states = force_response(path, -path.direction[:, None])
    row = sensor_row(order)
    friction = at_sensor(states, row, -path.expected_direction[:, None])
    columns = np.column_stack([at_sensor(initial_response(phase), row), friction, np.ones(SAMPLES)])
    return phase, columns * np.array([30.0, 30.0, 0.5, 1.0])


def calibrated(
    order: int,
    ratio: float,
    tau: float,
    positive: bool,
    seed: int,
    *,
    wrong: float = 1.0,
    count: int = REPLICATIONS,
):
    """Ranks of all coefficients, after the analyst took ``wrong`` times the force's size."""
    phase, columns = design(order)
    row, clock, size = sensor_row(order), Clock.of(phase), columns.shape[1]
    read = np.kron(np.eye(SAMPLES), row)
    covariance = ratio**2 * read @ dense_covariance(phase, np.ones(phase.size - 1), tau) @ read.T + np.eye(
        SAMPLES
    )
    root = np.linalg.cholesky(covariance)
    confined = (np.arange(size) == FRICTION) & positive

    def draw_prior(rng: np.random.Generator, n: int) -> np.ndarray:
        truth = rng.standard_normal((n, size))
        return np.where(confined, np.abs(truth), truth)

    def simulate(truth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return truth @ columns.T + rng.standard_normal((len(truth), SAMPLES)) @ root.T

    def cdf(data: np.ndarray, truth: np.ndarray) -> np.ndarray:
        found = [
            posterior for group in np.array_split(data, len(data) // 100) for posterior in marginals(group)
        ]
        mean, sd = (np.array(each) for each in zip(*found, strict=True))
        probability = ndtr((truth - mean) / sd)
        if positive:
            # beyond zero, relative to all that lies there
            beyond = log_ndtr((mean - truth)[:, FRICTION] / sd[:, FRICTION])
            mass = log_ndtr(mean[:, FRICTION] / sd[:, FRICTION])
            probability[:, FRICTION] = -np.expm1(beyond - mass)
        return np.clip(probability, 0.0, 1.0)

    def marginals(group: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Mean and sd of the coefficients of each record, whose whitened sums are those of all."""
        whitened = whiten(np.column_stack([columns, group.T]), clock, row, wrong * ratio, tau)
        every = np.ones(size, np.bool_)
        for k in range(size, size + len(group)):
            mine = [*range(size), k]
            own = whitened._replace(gram=whitened.gram[np.ix_(mine, mine)])
            found = evaluate_sets(own, np.zeros(size), confined, every[None], np.zeros(1))
            posterior = set_posterior(
                own.gram, np.zeros(size), every, found.full_noise2, float(found.noise2[0])
            )
            mean, scale2 = set_marginals(*posterior, every, confined)
            yield mean, np.sqrt(scale2)

    return testing.assert_calibrated(
        draw_prior, simulate, cdf, replications=count, seed=seed, false_alarm_rate=RARE
    )


@pytest.mark.parametrize(
    ("order", "ratio", "tau", "positive"),
    [
        pytest.param(0, 0.5, 1.0, False, id="displacement"),
        pytest.param(0, 3.0, 0.2, True, id="displacement, friction not negative"),
        pytest.param(1, 0.5, 5.0, False, id="velocity"),
        pytest.param(2, 2.0, 1.0, True, id="acceleration, friction not negative"),
    ],
)
def test_given_the_force(order: int, ratio: float, tau: float, positive: bool, seed: int) -> None:
    assert calibrated(order, ratio, tau, positive, seed).calibrated


@pytest.mark.parametrize("wrong", [0.0, 2.0])
def test_the_wrong_force_is_found(wrong: float, seed: int) -> None:
    with pytest.raises(AssertionError, match="not calibrated over 2000 replications"):
        calibrated(0, 0.5, 1.0, False, seed, wrong=wrong, count=FEW)
