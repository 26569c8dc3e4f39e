"""The phase of a decay, from rough starting values, with frequency constant or not."""

import numpy as np
import pytest

from friction_bayes.decay.linear_least_squares import solve_spd
from friction_bayes.decay.phase_polynomial import phase_at, time_of_phase
from friction_bayes.decay.phase_tracking import track_phase


def found_phase(polynomial: np.ndarray, n: int) -> np.ndarray:
    return np.polynomial.chebyshev.chebval(np.linspace(-1.0, 1.0, n), polynomial)


@pytest.mark.parametrize("step", [0.001, 0.01, 0.1])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_rough_frequency_and_phase_suffice(rng: np.random.Generator, step: float, order: int) -> None:
    omega, t = 2 * np.pi * 2.9, np.arange(0.0, 20.0, step)
    chi = omega * t + 0.8 + order * np.pi / 2
    half = np.floor((omega * t + 0.8) / np.pi)
    signal = (1.0 - 0.008 * half) * np.cos(chi)
    noise = rng.normal(0.0, 0.05, t.size)
    polynomial = track_phase(signal + noise, step, 1.02 * omega, 0.8 + 0.3, order, False)
    error = found_phase(polynomial, t.size) - chi
    # six free coefficients: mean square error 6 x 2 (sd/amplitude)**2 / n where the amplitude is typical
    typical = np.sqrt(12.0 / t.size) * 0.05 / 0.6
    assert np.abs(error[: t.size // 2]).max() < 6.0 * typical + 0.02


def test_frequency_that_changes_with_amplitude_is_followed() -> None:
    t = np.arange(0.0, 60.0, 0.005)
    amplitude = 1.0 - t / 70.0
    rate = 6.0 * (1.0 - amplitude**2 / 16.0)
    chi = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.005)]) + 0.4
    polynomial = track_phase(amplitude * np.cos(chi), 0.005, 5.8, 0.2, 0, False)
    assert np.abs(found_phase(polynomial, t.size) - chi).max() < 0.03


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("zeta", [0.005, 0.05, 0.15])
def test_the_phase_of_a_damped_decay_is_that_of_its_turning_points(order: int, zeta: float) -> None:
    """The motion about each centre is ``exp(-zeta theta) (cos theta + zeta sin theta)`` from its
    turning point; what is left of the phase's error is of second order in the damping.
    """
    theta = np.linspace(0.3, 12.0 * np.pi, 3000)
    half = np.floor(theta / np.pi)
    share, within = np.exp(-zeta * np.pi), theta - np.pi * half
    shift = 0.1 * share**12 * zeta
    swing, swings = 1.0 - shift, []
    for _ in range(13):
        swings.append(swing)
        swing = swing * share - 2.0 * shift
    side = (-1.0) ** half
    shape = (np.cos(within) + zeta * np.sin(within), -np.sin(within), zeta * np.sin(within) - np.cos(within))
    signal = side * np.array(swings)[half.astype(int)] * np.exp(-zeta * within) * shape[order]
    signal += side * shift if order == 0 else 0.0
    start, rate = theta[0], (theta[-1] - theta[0]) / (theta.size - 1)
    error = []
    for damped in (True, False):
        polynomial = track_phase(signal, 1.0, 1.01 * rate, start + 0.1, order, damped)
        error.append(np.abs(found_phase(polynomial, theta.size) - theta - order * np.pi / 2).max())
    assert error[0] < 3.0 * zeta**2
    assert error[0] < 0.3 * error[1]


def test_phase_and_time_are_inverse() -> None:
    polynomial = np.array([40.0, 38.0, 0.5, 0.2, 0.1, 0.05])
    at = time_of_phase(polynomial, 50.0, 12.0)
    value, slope = phase_at(polynomial, 2.0 * at / 12.0 - 1.0)
    assert value == pytest.approx(50.0, abs=1e-11)
    x = 2.0 * at / 12.0 - 1.0
    assert value == pytest.approx(np.polynomial.chebyshev.chebval(x, polynomial), rel=1e-14)
    derivative = np.polynomial.chebyshev.chebder(polynomial)
    assert slope == pytest.approx(np.polynomial.chebyshev.chebval(x, derivative), rel=1e-13)


def test_solve_spd(rng: np.random.Generator) -> None:
    root = rng.normal(size=(5, 5))
    matrix, right = root @ root.T + np.eye(5), rng.normal(size=5)
    x, ok = solve_spd(matrix, right)
    assert ok
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-10)
    matrix[:, 4] = matrix[:, 3]
    matrix[4, :] = matrix[3, :]
    assert not solve_spd(matrix, right)[1]


def test_too_short_a_record_keeps_the_rough_phase() -> None:
    polynomial = track_phase(np.zeros(5), 0.1, 6.0, 1.0, 1, False)
    assert phase_at(polynomial, -1.0)[0] == pytest.approx(1.0 + np.pi / 2)
    assert phase_at(polynomial, 1.0)[0] == pytest.approx(1.0 + np.pi / 2 + 6.0 * 0.4)
