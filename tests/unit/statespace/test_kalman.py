"""The regression under a random force: kernel against a dense normal, columns against an ODE solver."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import cho_factor, cho_solve, expm
from scipy.stats import multivariate_normal

from dense_force import dense_covariance
from friction_bayes.core.arrays import Array, Mask
from friction_bayes.core.errors import InputError
from friction_bayes.statespace.coloured_noise import Autoregression
from friction_bayes.statespace.force_grid import integrate_force
from friction_bayes.statespace.force_prior import ForcePrior, GridPoint, at_resonance
from friction_bayes.statespace.kalman import (
    Clock,
    CorrelatedError,
    Whitened,
    colour,
    jump_scores,
    sensor_row,
    smooth,
    whiten,
)
from friction_bayes.statespace.measured_path import MeasuredPath, stiffness_along
from friction_bayes.statespace.positive_orthant import confine, cut_moments, log_normal_mass
from friction_bayes.statespace.problem import Problem
from friction_bayes.statespace.regression import LawRegression, frequency_change
from friction_bayes.statespace.response import at_sensor, force_response
from friction_bayes.statespace.smoother import SmoothedMotion, first_motion
from friction_bayes.statespace.subset_evidence import (
    SetEvidences,
    bound_sets,
    evaluate_bounded,
    evaluate_sets,
    nest,
    set_marginals,
    set_posterior,
)
from friction_bayes.statespace.transition import initial_response

ORDERS = (0, 1, 2)
SENSORS = (*ORDERS, 3)
"""Of each derivative, and of an acceleration that has not one slope throughout."""


def stiffnesses(intervals: int, bent: bool) -> Array:
    """Of an oscillator, or one that changes from step to step, rounded as a path's is."""
    along = np.round(0.8 + 0.2 * np.cos(np.arange(intervals) ** 2), 1)
    return along if bent else np.ones(intervals)


def uneven_clock(rng: np.random.Generator, bent: bool) -> Clock:
    """Forty uneven steps with a gap, uneven variances and samples that are not used."""
    phase = np.cumsum(rng.uniform(0.02, 0.3, 40))
    phase[25:] += 4.0
    variance = rng.uniform(0.5, 2.0, 40)
    variance[[0, 7, 30]] = np.inf
    return Clock.of(phase, variance, stiffnesses(39, bent))


def piecewise_even_clock(rng: np.random.Generator, bent: bool) -> Clock:
    """Stretches so long that the gains settle; then a sample is not used, the step or the noise another."""
    del rng
    phase = np.cumsum(np.repeat([0.3, 0.7, 0.3], (40, 30, 50)))
    variance = np.repeat([1.0, np.inf, 1.0, 4.0], (20, 2, 68, 30))
    return Clock.of(phase, variance, stiffnesses(119, bent))


def all_sets(always: Mask) -> Mask:
    """Every set, shape (2**free, p), that contains the columns ``always``, shape (p,)."""
    free = np.flatnonzero(~always)
    sets = np.tile(always, (2**free.size, 1))
    sets[:, free] = (np.arange(2**free.size)[:, None] >> np.arange(free.size)) & 1
    return sets


def row_of(sensor: int, samples: int) -> Array:
    """Of the three derivatives and, as the fourth, of an acceleration whose slope is another half way."""
    slope = np.where(np.arange(samples) < samples // 2, 0.4, 0.9)
    return sensor_row(min(sensor, 2), slope if sensor == 3 else None)


@pytest.mark.parametrize("clock_of", [uneven_clock, piecewise_even_clock])
@pytest.mark.parametrize("error", [CorrelatedError(), CorrelatedError(2.0, 0.4)])
@pytest.mark.parametrize("ratio", [0.01, 1.0, 300.0])
@pytest.mark.parametrize(("bent", "tau"), [(False, 0.05), (True, 0.8), (False, 20.0)])
@pytest.mark.parametrize("sensor", SENSORS)
def test_whitening_and_smoothing_are_those_of_a_dense_normal(
    sensor, bent, tau, ratio, error, clock_of, rng
) -> None:
    clock = replace(clock_of(rng, bent), error=error)
    n = clock.phase.size
    row = row_of(sensor, n)
    block = rng.standard_normal((n, 4))
    states = np.zeros((n, 4, n, 4))
    states[:, :3, :, :3] = ratio**2 * dense_covariance(
        clock.phase, clock.stiffness[clock.index], tau
    ).reshape(n, 3, n, 3)
    apart = np.abs(np.subtract.outer(clock.phase, clock.phase))
    states[:, 3, :, 3] = error.ratio**2 * np.exp(-apart / error.tau)
    states = states.reshape(4 * n, 4 * n)
    used = np.isfinite(clock.variance)
    each = np.column_stack([np.broadcast_to(row, (n, 3)), np.ones(n)])
    reading = (np.eye(n)[:, :, None] * each).reshape(n, 4 * n)[used]
    factor = cho_factor(reading @ states @ reading.T + np.diag(clock.variance[used]))
    gram = block[used].T @ cho_solve(factor, block[used])
    whitened = whiten(block, clock, row, ratio, tau, keep=True)
    np.testing.assert_allclose(whitened.gram, gram, rtol=0, atol=1e-9 * np.abs(gram).max())
    np.testing.assert_allclose(
        whitened.columns.T @ whitened.columns, whitened.gram, atol=1e-12 * np.abs(gram).max()
    )
    assert whitened.log_determinant == pytest.approx(2.0 * np.log(np.diag(factor[0])).sum(), rel=1e-10)
    assert whitened.used == used.sum()

    gain = states @ reading.T @ cho_solve(factor, np.eye(used.sum()))
    smoothed, covariance = smooth(block, clock, row, ratio, tau)
    expected = (gain @ block[used]).reshape(n, 4, 4)
    np.testing.assert_allclose(smoothed, expected, atol=1e-8 * np.abs(expected).max())
    left = (states - gain @ reading @ states).reshape(n, 4, n, 4)
    left = np.array([left[i, :, i] for i in range(n)])
    np.testing.assert_allclose(covariance, left, atol=1e-7 * np.abs(left).max())
    assert np.all(np.diagonal(covariance, axis1=1, axis2=2) >= 0.0)


def jump_responses(clock: Clock, tau: float) -> np.ndarray:
    """Displacement, velocity and force at each sample, shape (n, 3, n), after a unit of each of them at one.

    By matrix exponentials: the last axis of those of the force alone is the sample before which it jumps.
    """
    n = clock.phase.size
    steps, stiffness = np.diff(clock.phase), clock.stiffness[clock.index]
    after = np.zeros((n, 3, n, 3))
    for i in range(n):
        after[i, :, i] = np.eye(3)
        for j in range(i + 1, n):
            drift = np.array([[0.0, 1.0, 0.0], [-stiffness[j - 1], 0.0, 1.0], [0.0, 0.0, -1.0 / tau]])
            after[j, :, i] = expm(drift * steps[j - 1]) @ after[j - 1, :, i]
    return after


@pytest.mark.parametrize("sensor", ORDERS)
def test_jump_scores_are_those_of_a_dense_normal(sensor: int, rng: np.random.Generator) -> None:
    clock, row, ratio, tau = uneven_clock(rng, True), sensor_row(sensor), 2.0, 0.7
    n, used = clock.phase.size, np.isfinite(clock.variance)
    states = ratio**2 * dense_covariance(clock.phase, clock.stiffness[clock.index], tau)
    reading = (np.eye(n)[:, :, None] * row).reshape(n, 3 * n)[used]
    inverse = np.linalg.inv(reading @ states @ reading.T + np.diag(clock.variance[used]))
    column = rng.standard_normal(n)
    shown_by_jump = np.einsum("nad,a->nd", jump_responses(clock, tau)[:, :, :, 2], row)[used]
    score = shown_by_jump.T @ inverse @ column[used]
    information = np.einsum("nd,nm,md->d", shown_by_jump, inverse, shown_by_jump)
    informative = information > 0.02 * np.median(information)
    found = jump_scores(column, clock, row, ratio, tau)
    np.testing.assert_allclose(
        found[informative], score[informative] / np.sqrt(information[informative]), rtol=1e-7
    )
    assert not found[~informative].any()


def test_a_force_that_may_jump_in_one_interval_adds_a_response_of_that_size(rng) -> None:
    plain = uneven_clock(rng, True)
    jump = np.zeros(plain.phase.size - 1)
    jump[[4, 20]] = 7.0
    clock = Clock.of(plain.phase, plain.variance, plain.stiffness[plain.index], jump)
    row, ratio, tau = sensor_row(1), 2.0, 0.7
    n, used = clock.phase.size, np.isfinite(clock.variance)
    states = ratio**2 * dense_covariance(clock.phase, plain.stiffness[plain.index], tau)
    after = jump_responses(clock, tau)
    for i in (4, 20):
        # what the force itself does within the step, as large as to give the jump its sd
        alone = Clock.of(clock.phase[i : i + 2], stiffness=plain.stiffness[plain.index][i : i + 1])
        within = alone.forced_steps(1.0, tau).added[0]
        response = after[:, :, i + 1].reshape(3 * n, 3)
        states += 7.0**2 / within[2, 2] * response @ within @ response.T
    reading = (np.eye(n)[:, :, None] * row).reshape(n, 3 * n)[used]
    covariance = reading @ states @ reading.T + np.diag(clock.variance[used])
    block = rng.standard_normal((n, 3))
    whitened = whiten(block, clock, row, ratio, tau)
    np.testing.assert_allclose(
        whitened.gram, block[used].T @ np.linalg.solve(covariance, block[used]), rtol=1e-8
    )
    assert whitened.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-10)


@pytest.mark.parametrize("noise", [None, Autoregression(np.array([0.6, -0.2]), 0.7)])
def test_gains_that_have_settled_change_with_the_slope_that_an_accelerometer_reads(noise, rng) -> None:
    phase, row, block = 0.3 * np.arange(2000.0), row_of(3, 2000), rng.standard_normal((2000, 2))
    # the least change of the noise from sample to sample keeps them from settling
    restless = np.where(np.arange(2000) % 2, 1.0, 1.0 + 1e-14)
    found, expected = (
        whiten(block, replace(Clock.of(phase, variance), autoregression=noise), row, 1.0, 1.0)
        for variance in (None, restless)
    )
    np.testing.assert_allclose(found.gram, expected.gram, rtol=1e-9)


@pytest.mark.parametrize("sensor", SENSORS)
def test_coloured_numbers_are_those_that_whitening_gives_back(sensor, rng) -> None:
    clock, row = replace(uneven_clock(rng, True), error=CorrelatedError(2.0, 0.4)), row_of(sensor, 40)
    used = np.isfinite(clock.variance)
    white = np.where(used[:, None], rng.standard_normal((40, 3)), 0.0)
    coloured = colour(white, clock, row, 3.0, 0.8)
    again = whiten(coloured, clock, row, 3.0, 0.8, keep=True).columns
    assert again is not None
    np.testing.assert_allclose(again, white, atol=1e-11)


@pytest.mark.parametrize("order", ORDERS)
def test_no_force_is_least_squares(order, rng) -> None:
    clock = uneven_clock(rng, False)
    block = rng.standard_normal((clock.phase.size, 3))
    whitened = whiten(block, clock, sensor_row(order), 0.0, 1.0)
    used = np.isfinite(clock.variance)
    expected = (block[used].T / clock.variance[used]) @ block[used]
    np.testing.assert_allclose(whitened.gram, expected, rtol=1e-13, atol=1e-13)
    assert whitened.log_determinant == pytest.approx(np.log(clock.variance[used]).sum(), abs=1e-12)


def motion_and_answers(phase: Array, shapes: list) -> Array:
    """States (n, 2 + 2 p) of a decay with friction and drag and of rest under each force, by solve_ivp."""
    z = np.zeros(2 + 2 * len(shapes))
    z[:2] = 1.0, -0.3
    now, sign = phase[0], -1.0
    rows = np.zeros((phase.size, z.size))
    while now < phase[-1]:

        def rate(t, z, sign=sign):
            x, v = z[:2]
            rates = [v, -x - 0.01 * sign - 0.01 * v * abs(v) - 0.003 * x + 0.002]
            for j, shape in enumerate(shapes):
                rates += [z[3 + 2 * j], -z[2 + 2 * j] + float(shape(x, v, sign))]
            return rates

        def turning(t, z, now=now, sign=sign):
            return z[1] if t > now + 1e-3 else 1e-3 * sign

        turning.terminal = True
        piece = solve_ivp(
            rate, (now, phase[-1]), z, rtol=1e-10, atol=1e-11, events=turning, dense_output=True
        )
        inside = (phase >= now) & (phase <= piece.t[-1])
        rows[inside] = piece.sol(phase[inside]).T
        now, z, sign = piece.t[-1], piece.y[:, -1], -sign
    return rows


@pytest.mark.parametrize(
    ("samples_per_period", "smooth_error", "sign_error"),
    [(20, 3e-5, 1e-3), (50, 1e-7, 1e-4), (300, 1e-8, 1e-6)],
)
def test_answers_to_forces_are_those_of_an_ode_solver(samples_per_period, smooth_error, sign_error) -> None:
    shapes = [
        lambda x, v, s: -s,
        lambda x, v, s: -x,
        lambda x, v, s: -v * np.abs(v),
        lambda x, v, s: 1.0 + 0.0 * x,
    ]
    phase = np.arange(0.0, 25.0, 2.0 * np.pi / samples_per_period)
    exact = motion_and_answers(phase, shapes)
    path = MeasuredPath.through(phase, exact[:, 0], exact[:, 1])
    assert path.turning.size == 8
    forces = np.stack([shape(path.node_x, path.node_v, path.direction) for shape in shapes], axis=1)
    states = force_response(path, forces)
    for order in (0, 1):
        columns, expected = at_sensor(states, sensor_row(order)), exact[:, 2 + order :: 2]
        error = np.abs(columns - expected).max(axis=0) / np.abs(expected).max(axis=0)
        assert error[0] < sign_error
        assert np.all(error[1:] < smooth_error)
    direct = np.stack([shape(path.x, path.v, path.expected_direction) for shape in shapes], axis=1)
    np.testing.assert_allclose(at_sensor(states, sensor_row(2), direct), direct - states[:, 0])


@pytest.mark.parametrize("stiffness", [None, (0.6, 1.0, -0.4, 0.0)])
def test_the_free_response_is_the_matrix_exponential(stiffness) -> None:
    phase = np.array([0.3, 0.9, 4.0, 4.2, 5.0])
    expected = [np.eye(2)]
    for step, k in zip(np.diff(phase), (1.0,) * 4 if stiffness is None else stiffness, strict=True):
        expected.append(expm(np.array([[0.0, 1.0], [-k, 0.0]]) * step) @ expected[-1])
    found = initial_response(phase, None if stiffness is None else np.array(stiffness))
    np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize(("samples_per_period", "error"), [(25, 0.4), (100, 0.1)])
def test_a_pendulum_is_as_stiff_as_its_restoring_force_is_steep(samples_per_period, error) -> None:
    """A change of the start, which grows with time, is carried the better the shorter the steps are."""
    phase = np.arange(0.0, 60.0, 2.0 * math.pi / samples_per_period)
    swing = solve_ivp(
        lambda t, z: [z[1], -math.sin(z[0])],
        (0.0, phase[-1]),
        [1.4, 0.0],
        t_eval=phase,
        rtol=1e-10,
        atol=1e-10,
        dense_output=True,
    )
    middle = swing.sol(0.5 * (phase[1:] + phase[:-1]))[0]
    ends = np.cos(swing.y[0])
    mean = (ends[:-1] + 4.0 * np.cos(middle) + ends[1:]) / 6.0
    np.testing.assert_allclose(stiffness_along(phase, *swing.y)[0], mean, atol=0.01)
    # a longer period than the pendulum's: its oscillation would grow without end
    assert np.all(stiffness_along(1.3 * phase, swing.y[0], swing.y[1] / 1.3)[0] == 1.0)
    path = MeasuredPath.through(phase, *swing.y, pendulum=True)
    near = solve_ivp(
        lambda t, z: [z[1], -math.sin(z[0])],
        (0.0, phase[-1]),
        [1.4 + 1e-4, 0.0],
        t_eval=phase,
        rtol=1e-11,
        atol=1e-11,
    )
    moved = 1e4 * (near.y - swing.y)
    response = initial_response(phase, path.stiffness)[:, :, 0].T
    np.testing.assert_allclose(response, moved, atol=error * np.abs(moved).max())
    # an accelerometer reads the change of the restoring force itself
    shown = at_sensor(initial_response(phase, path.stiffness), sensor_row(2, path.slope))[:, 0]
    change = 1e4 * (path.reading(2, *near.y) - path.reading(2, *swing.y))
    np.testing.assert_allclose(shown, change, atol=error * np.abs(moved).max())


def test_slopes_of_a_pendulum_serve_as_far_as_its_restoring_force_is_straight() -> None:
    phase = np.linspace(0.0, 6.0, 100)
    bent, straight = (
        MeasuredPath.through(phase, np.cos(phase), -np.sin(phase), pendulum=pendulum)
        for pendulum in (True, False)
    )
    # half the square of the distance times the sine of the angle
    force = 100.0 * 0.5 * 0.1**2 * math.sin(1.0)
    assert bent.serves(bent.x + 0.1, 1.3 * force)
    assert not bent.serves(bent.x + 0.1, 0.7 * force)
    assert straight.serves(straight.x + 0.1, 1e-9)


def test_a_gap_of_half_a_period_and_unsorted_stamps_are_refused() -> None:
    with pytest.raises(InputError, match=r"gap of 0\.6"):
        MeasuredPath.through(np.array([0.0, 3.9]), np.zeros(2), np.zeros(2))
    with pytest.raises(InputError, match="ascend"):
        Clock.of(np.array([0.0, 2.0, 1.0]))
    with pytest.raises(InputError, match="variance"):
        Clock.of(np.array([0.0, 1.0]), np.array([1.0, 0.0]))
    with pytest.raises(InputError, match="prior"):
        ForcePrior(centre=-1.0)


@pytest.mark.parametrize(("size", "constrained"), [(1, 1), (3, 1), (4, 2), (5, 3)])
@pytest.mark.parametrize("spread", [0.5, 2.0])
def test_positive_orthant(size, constrained, spread, rng) -> None:
    root = rng.standard_normal((size, size))
    cov = root @ root.T + 0.05 * np.eye(size)
    mean = rng.standard_normal(size) * np.sqrt(np.diag(cov)) * spread / 2
    positive = np.arange(size) < constrained
    location, scale2 = np.empty(size), np.empty(size)
    log_mass = confine(mean, cov, positive, location, scale2)
    part = slice(constrained)
    exact = multivariate_normal(-mean[part], cov[part, part]).cdf(np.zeros(constrained))
    assert log_mass == pytest.approx(np.log(exact), abs=0.01 + 0.02 * (constrained > 2))
    draws = rng.multivariate_normal(mean, cov, 400_000)
    draws = draws[(draws[:, part] > 0.0).all(axis=1)]
    for i in range(size):
        moments = cut_moments(location[i], scale2[i])[1:] if positive[i] else (location[i], scale2[i])
        sd = draws[:, i].std()
        allowed = 0.05 + 5.0 / math.sqrt(len(draws))
        assert abs(moments[0] - draws[:, i].mean()) < allowed * sd
        assert abs(math.sqrt(moments[1]) / sd - 1.0) < allowed


def test_tails_join_their_series() -> None:
    for z in (-29.9999, -30.0001):
        mass, mean, variance = cut_moments(z, 1.0)
        assert mass == log_normal_mass(z)
        assert mean == pytest.approx(1.0 / 30.0 * (1.0 - 2.0 / 900.0), rel=1e-4)
        assert variance == pytest.approx(1.0 / 900.0 * (1.0 - 6.0 / 900.0), rel=1e-4)
    one, other = (cut_moments(z, 1.0) for z in (-30.0 + 1e-9, -30.0 - 1e-9))
    np.testing.assert_allclose(one[1:], other[1:], rtol=1e-7)
    far = cut_moments(-1e6, 1.0)
    np.testing.assert_allclose(far[1:], (1e-6, 1e-12), rtol=1e-6)


def test_mass_and_marginals_far_from_the_orthant_stay_finite() -> None:
    cov = np.array([[1.0, 0.99999], [0.99999, 1.0]])
    location, scale2 = np.empty(2), np.empty(2)
    log_mass = confine(np.array([-60.0, 40.0]), cov, np.ones(2, np.bool_), location, scale2)
    assert log_mass < -500.0
    assert np.all(np.isfinite(location))
    assert np.all(scale2 > 0.0)


def test_coefficients_are_all_positive_at_most_as_often_as_each(rng) -> None:
    """Near collinear and thousands of standard deviations below zero, where rounding decides."""
    for _ in range(1000):
        size = rng.integers(2, 6)
        axes, _ = np.linalg.qr(rng.standard_normal((size, size)))
        cov = (axes * 10.0 ** rng.uniform(-6.0, 0.0, size)) @ axes.T
        sd = np.sqrt(np.diag(cov))
        distances = rng.standard_normal(size) * 10.0 ** rng.uniform(-1.0, 4.0)
        log_mass = confine(distances * sd, cov, np.ones(size, np.bool_), np.empty(size), np.empty(size))
        most = log_normal_mass(distances.min())
        assert -math.inf < log_mass <= most + 1e-9 * abs(most)


@pytest.mark.parametrize("correlation", [-1.0, 0.0, 0.9, 1.0])
def test_what_rounding_leaves_without_an_answer_is_impossible(correlation) -> None:
    cov = np.array([[1.0, correlation], [correlation, 1.0]])
    location, scale2 = np.empty(2), np.empty(2)
    log_mass = confine(np.full(2, -1e9), cov, np.ones(2, np.bool_), location, scale2)
    assert log_mass < -1e17
    assert np.all(scale2 > 0.0)


def marginals(
    whitened: Whitened, reference: Array, columns: Mask, positive: Mask, found: SetEvidences, k: int
) -> tuple[Array, Array]:
    """Of set ``k`` of those that have been evaluated."""
    posterior = set_posterior(whitened.gram, reference, columns, found.full_noise2, float(found.noise2[k]))
    return set_marginals(*posterior, columns, positive)


def test_sets_are_evaluated_as_one_by_one(rng) -> None:
    """The evidence of every set is that of its own dense regression; a positive one adds its mass."""
    columns = rng.standard_normal((200, 4))
    record = columns @ np.array([2.0, 0.0, 0.05, -0.02]) + rng.standard_normal(200)
    reference = np.array([1.9, 0.1, 0.0, 0.0])
    clock = Clock.of(np.arange(200.0))
    whitened = whiten(
        np.column_stack([columns, record - columns @ reference]), clock, sensor_row(0), 0.0, 1.0
    )
    sets = all_sets(np.array([True, False, False, False]))
    assert sets.shape == (8, 4)
    none = np.zeros(4, np.bool_)
    free = evaluate_sets(whitened, reference, none, sets, np.zeros(8))
    for k, columns_in in enumerate(sets):
        x = columns[:, columns_in]
        penalised = x.T @ x + free.full_noise2 * np.eye(x.shape[1])
        mean = np.linalg.solve(penalised, x.T @ record)
        rest = record @ record - mean @ penalised @ mean
        log_evidence = 0.5 * x.shape[1] * np.log(free.full_noise2)
        log_evidence -= 0.5 * np.linalg.slogdet(penalised)[1] + 100.0 * np.log(0.5 * rest)
        assert free.log_weight[k] == pytest.approx(log_evidence, abs=1e-8)
        location, scale2 = marginals(whitened, reference, columns_in, none, free, k)
        np.testing.assert_allclose(location[columns_in], mean, atol=1e-10)
        np.testing.assert_allclose(
            scale2[columns_in], rest / 200 * np.diag(np.linalg.inv(penalised)), rtol=1e-10
        )
        assert np.all(np.isnan(location[~columns_in]))
    positive = np.array([False, False, False, True])
    cut = evaluate_sets(whitened, reference, positive, sets, np.zeros(8))
    k = 4
    location, scale2 = marginals(whitened, reference, sets[k], none, free, k)
    mass = log_normal_mass(float(location[3] / np.sqrt(scale2[3])))
    assert sets[k].tolist() == [True, False, False, True]
    assert cut.log_weight[k] - free.log_weight[k] == pytest.approx(math.log(2.0) + mass, abs=1e-8)


def test_sets_have_the_same_evidence_in_any_order(rng) -> None:
    """What begins alike is eliminated once; two sets are the same, and sets lack what the reference has."""
    columns = rng.standard_normal((100, 9))
    law = np.where(np.arange(9) < 4, rng.standard_normal(9), 0.0)
    record = columns @ law + rng.standard_normal(100)
    reference = np.where(np.arange(9) < 6, law + 0.1, 0.0)
    block = np.column_stack([columns, record - columns @ reference])
    whitened = whiten(block, Clock.of(np.arange(100.0)), sensor_row(0), 0.0, 1.0)
    sets = rng.permutation(all_sets(np.arange(9) < 1))
    sets[17] = sets[3]
    in_turn = nest(sets).inside
    shared = (in_turn[1:] == in_turn[:-1]).cumprod(axis=1).sum(axis=1)
    assert shared.mean() > 6.5
    positive, none = np.arange(9) > 6, np.zeros(len(sets))
    given = (whitened, reference, positive, sets)
    nested = evaluate_bounded(*given, bound_sets(*given, none, nested=nest(sets)))
    for name, expected in evaluate_sets(whitened, reference, positive, sets, none)._asdict().items():
        np.testing.assert_allclose(getattr(nested, name), expected, rtol=1e-9, atol=1e-12)
    for k in range(0, len(sets), 50):
        alone = evaluate_sets(whitened, reference, positive, sets[[k]], none[:1])
        assert nested.noise2[k] == pytest.approx(alone.noise2[0], rel=1e-9)
        if nested.log_weight[k] > nested.log_weight.max() - 12.0:
            assert nested.log_weight[k] == pytest.approx(alone.log_weight[0], abs=1e-8)


def test_columns_that_are_the_same_to_rounding_are_borne(rng) -> None:
    """Of these no Cholesky factor of the library's exists where the noise is below rounding."""
    columns = rng.standard_normal((300, 4))
    columns[:, 1:3] = columns[:, :1] * (1.0 + 1e-15 * rng.standard_normal((300, 2)))
    block = np.column_stack([columns, 1e-7 * rng.standard_normal(300)])
    whitened = whiten(block, Clock.of(np.arange(300.0)), sensor_row(0), 0.0, 1.0)
    given = (whitened, np.ones(4), np.arange(4) > 2, np.ones((1, 4), np.bool_))
    bounds = bound_sets(*given, np.zeros(1))
    assert evaluate_bounded(*given, bounds).log_weight[0] <= bounds.log_weight[0]


def test_noise_is_not_taken_below_its_least(rng) -> None:
    """Above the least noise nothing changes; below it the likelihood is that of this noise."""
    columns, record = rng.standard_normal((300, 2)), rng.standard_normal(300)
    whitened = whiten(np.column_stack([columns, record]), Clock.of(np.arange(300.0)), sensor_row(0), 0.0, 1.0)
    sets = all_sets(np.array([True, False]))

    def evaluated(least: float):  # type: ignore[no-untyped-def]
        none = np.zeros(2)
        return evaluate_sets(whitened, none, np.zeros(2, np.bool_), sets, none, least_noise2=least)

    np.testing.assert_array_equal(evaluated(0.5).log_weight, evaluated(0.0).log_weight)
    bound = evaluated(4.0)
    np.testing.assert_array_equal(bound.noise2, 4.0)
    for k, inside in enumerate(sets):
        x = columns[:, inside]
        penalised = x.T @ x + 4.0 * np.eye(x.shape[1])
        mean = np.linalg.solve(penalised, x.T @ record)
        rest = record @ record - mean @ penalised @ mean
        expected = 0.5 * x.shape[1] * np.log(4.0) - 0.5 * np.linalg.slogdet(penalised)[1]
        # the normal density of all samples, with the constant that the free noise leaves at its best
        expected -= 0.5 * (300.0 * np.log(0.5 * 300.0 * 4.0) + rest / 4.0 - 300.0)
        assert bound.log_weight[k] == pytest.approx(expected, abs=1e-8)
        _, covariance = set_posterior(whitened.gram, np.zeros(2), inside, bound.full_noise2, bound.noise2[k])
        np.testing.assert_allclose(covariance, 4.0 * np.linalg.inv(penalised))


def problem_along_known_motion(rng: np.random.Generator, force_sd: float) -> tuple[Problem, float]:
    """Start and friction of a slow decay, with a force of a given sd and unit noise."""
    phase = np.arange(600) * 0.2
    amplitude = 1000.0 - 4.0 * phase
    path = MeasuredPath.through(phase, amplitude * np.cos(phase), -amplitude * np.sin(phase))
    friction = at_sensor(force_response(path, -path.direction[:, None]), sensor_row(0))
    columns = np.column_stack([at_sensor(initial_response(phase), sensor_row(0)), friction])
    steps = rng.standard_normal(600)
    force = np.empty(600)
    force[0] = steps[0]
    decay = math.exp(-0.2 / 0.5)
    for i in range(1, 600):
        force[i] = decay * force[i - 1] + math.sqrt(1.0 - decay**2) * steps[i]
    at_nodes = force_sd * np.interp(path.node_phase, phase, force)[:, None]
    record = columns @ np.array([1000.0, 0.0, 6.0]) + rng.standard_normal(600)
    record = record + at_sensor(force_response(path, at_nodes), sensor_row(0))[:, 0]
    regression = LawRegression(
        clock=Clock.of(phase),
        row=sensor_row(0),
        names=("x0", "v0", "friction"),
        columns=columns,
        states=np.zeros((600, 2, 3)),
        known_states=np.zeros((600, 2)),
        target=record,
        scale=np.array([1e4, 1e4, 12.0]),
        positive=np.zeros(3, np.bool_),
        sets=np.ones((1, 3), np.bool_),
        log_prior=np.zeros(1),
        stiffness=0,
        motion=SmoothedMotion(
            states=np.zeros((600, 3)), covariance=np.zeros((600, 3, 3)), noise=1.0, force_sd=1.0, tau=1.0
        ),
    )
    return Problem.of(regression), 6.0


def test_average_over_the_force(rng) -> None:
    problem, friction = problem_along_known_motion(rng, 3.0)
    prior = ForcePrior(centre=0.2 * friction)
    posterior = integrate_force(problem, prior)
    assert posterior.probability > 0.99
    assert 2.0 < posterior.force_sd.mean() < 4.5
    assert 0.2 < posterior.correlation_time.mean() < 1.2
    assert posterior.noise_sd == pytest.approx(1.0, rel=0.15)
    assert posterior.best_law()[2] == pytest.approx(posterior.coefficient("friction").mean(), rel=0.2)
    # the grid carries the whole of the posterior: against a fine one in (log q / sigma, log tau)
    value, weight = [], []
    for ratio in np.exp(np.linspace(np.log(0.8), np.log(12.0), 28)):
        for tau in np.exp(np.linspace(np.log(prior.tau_low), np.log(prior.tau_high), 28)):
            found = problem.evaluate(ratio, tau)
            q = ratio * math.sqrt(found.noise2[0])
            weight.append(found.log_weight[0] + prior.log_density(q, 0.999 * tau + 0.001))
            point = GridPoint(ratio=ratio, tau=tau, log_volume=0.0, found=found)
            location, scale2 = problem.marginals(point, 0)
            value.append((location[2] * 12.0, scale2[2] * 144.0))
    weight = np.exp(np.array(weight) - max(weight))
    weight /= weight.sum()
    mean, variance = np.array(value).T
    average = weight @ mean
    sd = math.sqrt(weight @ (variance + (mean - average) ** 2))
    given = posterior.among((posterior.ratio > 0.0)[:, None]).coefficient("friction")
    assert given.mean() == pytest.approx(average, abs=0.05 * sd)
    assert given.std() == pytest.approx(sd, rel=0.05)
    none = integrate_force(problem, ForcePrior(centre=1.0, none=1.0))
    assert none.probability == 0.0
    with pytest.raises(InputError, match="none has been looked at"):
        _ = none.force_sd


def test_first_motion_finds_the_noise(rng) -> None:
    phase = np.arange(800) * 0.1
    amplitude = 100.0 - phase
    motion = amplitude * np.cos(phase)
    clock = Clock.of(phase)
    found = first_motion(motion + 3.0 + 0.5 * rng.standard_normal(800), clock, sensor_row(0))
    assert found.noise == pytest.approx(0.5, rel=0.1)
    error = found.states[:, 0] - motion - 3.0
    assert np.sqrt(np.mean(error**2)) < 0.4
    # the covariance is that given the start
    assert np.sqrt(np.mean(error[100:] ** 2 / found.covariance[100:, 0, 0])) < 2.0
    assert np.all(found.velocity_sd[1:] > 0.0)


@pytest.mark.parametrize("order", ORDERS)
def test_a_corrected_frequency_leaves_displacements_and_rescales_velocities(order, rng) -> None:
    """A harmonic motion analysed at a reference frequency 3 % too low, in units of it and of its own."""
    frequency, reference, time = 10.0, 10.0 / 1.03, np.arange(0.0, 15.0, 0.01)
    motion = np.stack([np.cos(frequency * time), -np.sin(frequency * time)], axis=1)
    measured = (motion[:, 0], frequency * motion[:, 1], -(frequency**2) * motion[:, 0])[order]
    signal = measured / reference**order + 1e-3 * rng.standard_normal(time.size)
    clock, row = Clock.of(reference * time), sensor_row(order)
    first = first_motion(signal, clock, row)
    path = MeasuredPath.through(clock.phase, *first.states[:, :2].T.copy())
    answered, start = force_response(path, -path.node_x[:, None]), initial_response(clock.phase)
    regression = LawRegression(
        clock=clock,
        row=row,
        names=("displacement", "velocity", "stiffness"),
        columns=np.hstack([at_sensor(start, row), at_sensor(answered, row, -path.x[:, None])]),
        states=np.concatenate([start, answered], axis=2),
        known_states=np.zeros((time.size, 2)),
        target=signal,
        scale=np.array([10.0, 10.0, 0.05]),
        positive=np.zeros(3, bool),
        sets=np.ones((1, 3), bool),
        log_prior=np.zeros(1),
        stiffness=2,
        motion=first,
    )
    found = integrate_force(Problem.of(regression), ForcePrior(centre=1e-3), only_mode=True)
    law = found.best_law()
    change = frequency_change(law[regression.stiffness])
    assert change == pytest.approx(1.03, abs=1e-3)
    smoothed = regression.smoothed(law, found.best).at_frequency(change)
    for j in (0, 1):
        share = smoothed.states[:, j] @ motion[:, j] / (motion[:, j] @ motion[:, j])
        assert share == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("ratio", [0.0, 0.1, 3.0])
@pytest.mark.parametrize("sensor", SENSORS)
def test_a_left_out_sample_is_predicted_by_the_others_alone(sensor, ratio, rng) -> None:
    """As where the sample is not used: the error is the same, and its variance but for the sample's own."""
    clock, row, tau = uneven_clock(rng, 0.0), row_of(sensor, 40), 0.8
    n = clock.phase.size
    still = SmoothedMotion(
        states=np.zeros((n, 3)), covariance=np.zeros((n, 3, 3)), noise=1.0, force_sd=ratio, tau=tau
    )

    def regression(variance: Array) -> LawRegression:
        start = initial_response(clock.phase)
        return LawRegression(
            clock=Clock.of(clock.phase, variance),
            row=row,
            names=("displacement", "velocity"),
            columns=at_sensor(start, row),
            states=start,
            known_states=np.zeros((n, 2)),
            target=target,
            scale=np.ones(2),
            positive=np.zeros(2, bool),
            sets=np.ones((1, 2), bool),
            log_prior=np.zeros(1),
            stiffness=0,
            motion=still,
        )

    target, law = rng.standard_normal(n), np.array([0.3, -0.2])
    error, variance = regression(clock.variance).left_out(law, ratio, tau)
    for i in (0, 1, 7, 12, 26, n - 1):
        own = clock.variance[i] if np.isfinite(clock.variance[i]) else 1.0
        others = np.where(np.arange(n) == i, np.inf, clock.variance)
        expected, spread = (values[i] for values in regression(others).left_out(law, ratio, tau))
        assert error[i] == pytest.approx(expected, rel=1e-7)
        assert variance[i] == pytest.approx(spread - 1.0 + own, rel=1e-7)


class Bump:
    """A likelihood that is normal in the force at resonance and the logarithm of its correlation time."""

    names, scale, positive = ("b",), np.ones(1), np.zeros(1, np.bool_)
    sets = np.ones((1, 1), np.bool_)
    noise_before = 1.0

    def __init__(self, log_tau: float, sd: tuple[float, float], slope: float) -> None:
        self.log_tau, self.sd, self.slope = log_tau, sd, slope

    def log_likelihood(self, ratio: np.ndarray, tau: np.ndarray) -> np.ndarray:
        across = np.log(ratio * at_resonance(tau)) - self.slope * (np.log(tau) - self.log_tau)
        return -0.5 * ((across / self.sd[0]) ** 2 + ((np.log(tau) - self.log_tau) / self.sd[1]) ** 2)

    def among(self, sets: np.ndarray) -> Bump:
        assert sets.all()
        return self

    def evaluate(self, ratio: float, tau: float) -> SetEvidences:
        value = float(self.log_likelihood(np.array(ratio), np.array(tau))) if ratio > 0.0 else 0.0
        return SetEvidences(np.array([value]), np.ones(1), 1.0)


@pytest.mark.parametrize("slope", [0.0, 0.4])
@pytest.mark.parametrize(
    ("edge", "beyond"), [("tau_low", -0.3), ("tau_low", 0.5), ("tau_high", 0.3), ("tau_high", -0.5)]
)
def test_the_grid_of_the_force_ends_where_the_prior_does(edge: str, beyond: float, slope: float) -> None:
    """A cell across an end of the correlation time counts by its part within: against a fine grid."""
    prior = ForcePrior(centre=1.0, none=0.5)
    bump = Bump(math.log(getattr(prior, edge)) + beyond, (0.3, 0.8), slope)
    posterior = integrate_force(bump, prior)
    log_tau = np.linspace(math.log(prior.tau_low), math.log(prior.tau_high), 801)
    log_ratio = np.linspace(-12.0, 12.0, 4801)
    ratio, tau = np.exp(log_ratio)[:, None], np.exp(log_tau)
    density = np.exp(bump.log_likelihood(ratio, tau) + prior.log_density(ratio, tau))
    mass = np.trapezoid(np.trapezoid(density, log_ratio, axis=0), log_tau)
    found = np.exp(posterior.log_evidence) - prior.none
    # where the density still rises at the end, the middle of a cell's part within represents it roughly
    assert found == pytest.approx(mass, rel=0.07)
    moments = [
        np.trapezoid(np.trapezoid(density * ratio**k, log_ratio, axis=0), log_tau) / mass for k in (1, 2)
    ]
    sd = math.sqrt(moments[1] - moments[0] ** 2)
    assert posterior.force_sd.mean() == pytest.approx(moments[0], abs=0.1 * sd)
    assert posterior.force_sd.std() == pytest.approx(sd, rel=0.1)
