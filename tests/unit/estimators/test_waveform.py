"""The whole-signal estimator: derivatives, likelihood, closed form against target, notes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from decays import SYSTEM, short_decay
from friction_bayes import Pendulum, simulate
from friction_bayes.core.errors import InputError
from friction_bayes.core.quantities import quantity_named
from friction_bayes.decay.free_decay import find_free_decay
from friction_bayes.decay.whiteness import whiteness
from friction_bayes.estimators.base import Fit
from friction_bayes.estimators.waveform.coulomb_signal import (
    CURVED_PAIRS,
    crossing_misfit,
    exact_misfit,
    signal_derivatives,
    signals,
    turning_samples,
)
from friction_bayes.estimators.waveform.estimator import WaveformEstimator
from friction_bayes.estimators.waveform.least_squares import fit_waveforms
from friction_bayes.estimators.waveform.normal_equations import (
    EVENLY,
    NormalEquations,
    Samples,
    Signal,
    accumulate,
)
from friction_bayes.estimators.waveform.signal_expansion import SignalExpansion

WAVEFORM = WaveformEstimator()
QUANTITIES = ("displacement", "velocity", "acceleration")
FRICTION = 0.3
COEFFICIENTS = np.array([0.2, 5.0, 0.21, 40.3, 45.1])
KAPPA = 29.0
STOP = 24
N = 301
LATE = np.linspace(-1.0, 1.0, N)
LATE[1:-1:2] += 0.8 / N
SAMPLES = (Samples(N, EVENLY), Samples(N, LATE))
"""Evenly spaced, and every other one late."""


def fit(
    quantity: str = "displacement", *, noise: float = 0.05, seed: int = 3, rest: float | None = None
) -> Fit:
    """Fit of a decay of 49 half cycles that starts in mid-motion, noise relative to the largest value."""
    quiet = simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=0.02,
        initial_velocity=-0.22,
        duration=17.0,
        sampling_rate=97.0,
        quantity=quantity,
    )
    sd = noise * float(np.abs(quiet).max())
    record = quiet + 3.0 * sd + sd * np.random.default_rng(seed).standard_normal(quiet.size)
    record.attrs = quiet.attrs
    decay = find_free_decay(record, SYSTEM, rest_position=None if rest is None else rest * sd)
    return WAVEFORM.fit(decay, WAVEFORM.default_prior(decay), peaks="highest")


@pytest.mark.parametrize("samples", SAMPLES, ids=["even", "uneven"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_derivatives_are_those_of_the_signal(order: int, samples: Samples) -> None:
    jacobian, curvature = signal_derivatives(samples, order, COEFFICIENTS, KAPPA, STOP)
    steps = np.array([1e-3, 1e-3, 1e-4, 1e-5, 1e-5])
    shifts = np.diag(steps)
    at = signals(samples, order, COEFFICIENTS + np.concatenate([shifts, -shifts]), KAPPA, STOP)
    edge = np.concatenate(
        [turning_samples(samples, p, STOP) for p in COEFFICIENTS + np.concatenate([shifts, -shifts])]
    )
    smooth = np.setdiff1d(np.arange(N), np.concatenate([edge, edge - 1]))
    numeric = ((at[:5] - at[5:]) / (2.0 * steps[:, None])).T
    np.testing.assert_allclose(jacobian[smooth], numeric[smooth], atol=1e-6)
    for column, (i, j) in enumerate(CURVED_PAIRS):
        moved = [
            signal_derivatives(samples, order, COEFFICIENTS + s * shifts[j], KAPPA, STOP)[0][:, i]
            for s in (1, -1)
        ]
        second = (moved[0] - moved[1]) / (2.0 * steps[j])
        np.testing.assert_allclose(curvature[smooth, column], second[smooth], atol=1e-5)


@pytest.mark.parametrize("samples", SAMPLES, ids=["even", "uneven"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_streamed_sums_are_those_of_the_design(
    order: int, samples: Samples, rng: np.random.Generator
) -> None:
    y = signals(samples, order, COEFFICIENTS[None], KAPPA, STOP)[0] + rng.standard_normal(N)
    matrix, gradient = np.zeros((5, 5)), np.zeros(5)
    at = NormalEquations(COEFFICIENTS, matrix, gradient)
    misfit = accumulate(Signal(y, samples, order, KAPPA), at, COEFFICIENTS, STOP)
    jacobian, _ = signal_derivatives(samples, order, COEFFICIENTS, KAPPA, STOP)
    residual = y - signals(samples, order, COEFFICIENTS[None], KAPPA, STOP)[0]
    assert misfit == pytest.approx(residual @ residual, rel=1e-12)
    np.testing.assert_allclose(np.tril(matrix), np.tril(jacobian.T @ jacobian), rtol=1e-10, atol=1e-8)
    np.testing.assert_allclose(gradient, jacobian.T @ residual, rtol=1e-10, atol=1e-8)


@pytest.mark.parametrize("samples", SAMPLES, ids=["even", "uneven"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_expansion_with_crossings_is_the_exact_misfit(
    order: int, samples: Samples, rng: np.random.Generator
) -> None:
    y = signals(samples, order, COEFFICIENTS[None], KAPPA, STOP)[0] + 0.5 * rng.standard_normal(N)
    jacobian, curvature = signal_derivatives(samples, order, COEFFICIENTS, KAPPA, STOP)
    residual = y - signals(samples, order, COEFFICIENTS[None], KAPPA, STOP)[0]
    expansion = SignalExpansion.of(COEFFICIENTS, residual, jacobian, curvature, np.array(CURVED_PAIRS))
    near = COEFFICIENTS + rng.standard_normal((40, 5)) * [0.1, 0.1, 0.01, 3e-3, 3e-3]
    fast = expansion.misfit(near) + crossing_misfit(y, samples, order, COEFFICIENTS, near, KAPPA, STOP)
    np.testing.assert_allclose(fast, exact_misfit(y, samples, order, near, KAPPA, STOP), atol=5e-3)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_recovers_the_truth_without_noise(quantity: str) -> None:
    result = fit(quantity, noise=0.0)
    order = QUANTITIES.index(quantity)
    truth = FRICTION / SYSTEM.force_factor(quantity_named(quantity))
    assert result.coefficient.mean() == pytest.approx(truth, rel=1e-5 if order < 2 else 1e-3)
    assert result.frequency == pytest.approx(10.0, rel=1e-5)
    assert result.rest_position == pytest.approx(0.0, abs=1e-5)
    assert any("no noise" in note for note in result.notes)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_estimate_of_a_noisy_record(quantity: str) -> None:
    result = fit(quantity)
    z = (result.coefficient.mean() - fit(quantity, noise=0.0).coefficient.mean()) / result.coefficient.std()
    assert abs(z) < 4.0
    assert 0.001 < result.coefficient.std() / result.coefficient.mean() < 0.05
    # only the jumps of an acceleration are worth a word
    assert [note for note in result.notes if "jumps" not in note] == []
    assert bool(result.notes) == (quantity == "acceleration")


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("rest", [None, 3.0])
def test_closed_form_is_the_target_given_frequency_and_phase(
    quantity: str, rest: float | None, rng: np.random.Generator
) -> None:
    target = fit(quantity, rest=rest).target
    size = target.centre.size
    points = target.centre + rng.standard_normal((60, size)) @ np.linalg.cholesky(target.covariance).T
    points[:, -3:-1] = target.centre[-3:-1]
    difference = target.log_prob(points) - target.closed_form(points)
    assert np.ptp(difference) < 1e-5
    assert np.ptp(target.closed_form(points)) > 1.0


def test_target_moves_with_frequency_and_phase_as_the_linearisation_says(rng: np.random.Generator) -> None:
    target = fit("displacement", noise=0.01).target
    points = target.centre + rng.standard_normal((60, 6)) @ np.linalg.cholesky(target.covariance).T
    difference = target.log_prob(points) - target.closed_form(points)
    assert np.ptp(difference) < 0.2
    far = points + 1e3 * np.sqrt(np.diag(target.covariance))
    assert np.all(target.log_prob(far) < target.log_prob(points).min())


def test_pointwise_adds_up_to_the_likelihood(rng: np.random.Generator) -> None:
    result = fit()
    target = result.target
    points = target.centre + rng.standard_normal((7, 6)) @ np.linalg.cholesky(target.covariance).T
    blocks = target.pointwise(points)
    assert blocks.shape == (7, result.amplitudes + 1)
    np.testing.assert_allclose(
        blocks.sum(axis=1), target.log_prob(points) - target.log_prior(points), atol=0.05
    )


def test_prior_draws_and_prediction(rng: np.random.Generator) -> None:
    target = fit().target
    draws = target.prior_draws(rng, 2000)
    frequency = draws[:, target.names.index("frequency")]
    assert 10.0 / 3.0 < frequency.min() < 4.0
    assert 28.0 < frequency.max() < 30.0
    assert np.all(np.isfinite(target.log_prior(draws)))
    replicated = target.predictive(np.tile(target.centre, (50, 1)), rng)
    assert replicated.shape == (50, target.observed.size)
    residual = replicated - target.observed
    assert residual.std() == pytest.approx(math.sqrt(2.0 * math.exp(target.centre[-1])), rel=0.05)


def test_natural_parameters_carry_the_force() -> None:
    result = fit()
    natural = result.target.posterior(result.target.centre[None])
    assert natural["friction"][0] == pytest.approx(1000.0 * result.coefficient.mean())
    assert natural["precision"][0] == pytest.approx(result.precision.mean(), rel=0.01)


def test_coloured_residuals_are_reported(rng: np.random.Generator) -> None:
    smooth = np.convolve(rng.standard_normal(2005), np.ones(6) / 6.0, mode="valid")
    assert whiteness(smooth).p_value < 1e-12
    assert whiteness(smooth).lag1 == pytest.approx(5.0 / 6.0, abs=0.1)
    assert whiteness(rng.standard_normal(2000)).p_value > 1e-4
    effects = {"viscous_damping.damping_ratio": 0.01}
    viscous = short_decay(friction=FRICTION, duration=10.0, effects=effects)
    decay = find_free_decay(viscous, SYSTEM)
    notes = WAVEFORM.fit(decay, WAVEFORM.default_prior(decay), peaks="highest").notes
    assert any("closing the loop" in note for note in notes)


@pytest.mark.parametrize("quantity", ["angle", "angular_velocity", "angular_acceleration"])
@pytest.mark.parametrize("amplitude", [0.1, 2.4])
def test_pendulum(quantity: str, amplitude: float, rng: np.random.Generator) -> None:
    system = Pendulum(inertia=0.0033, stiffness=0.2137)
    friction = 0.008 * amplitude * system.stiffness
    quiet = simulate(
        system,
        friction=friction,
        initial_displacement=-amplitude,
        duration=15.0,
        sampling_rate=60.0,
        quantity=quantity,
    )
    sd = 0.02 * float(quiet.std())
    record = quiet + sd * rng.standard_normal(quiet.size)
    record.attrs = quiet.attrs
    decay = find_free_decay(record, system)
    result = WAVEFORM.fit(decay, WAVEFORM.default_prior(decay), peaks="highest")
    truth = friction / system.force_factor(decay.quantity)
    assert abs(result.coefficient.mean() - truth) < 5.0 * result.coefficient.std()
    assert result.coefficient.std() < 0.02 * truth
    assert result.frequency == pytest.approx(system.natural_frequency, rel=0.003)
    points = (
        result.target.centre + rng.standard_normal((30, 6)) @ np.linalg.cholesky(result.target.covariance).T
    )
    if quantity != "angular_acceleration":
        assert np.ptp(result.target.log_prob(points) - result.target.closed_form(points)) < 0.5


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_samples_are_taken_at_their_own_times(quantity: str, rng: np.random.Generator) -> None:
    """A clock that goes fast and slow by 2 %, at eight samples a period; noise 1 % of the amplitude."""
    fine = short_decay(friction=FRICTION, sampling_rate=20_000.0, noise_sd=0.0, quantity=quantity)
    intervals = 1600.0 * (1.0 + 0.02 * np.sin(np.arange(62) / 5.0))
    chosen = np.unique(np.round(np.cumsum(intervals)).astype(int))
    record = fine[chosen[chosen < fine.size]]
    sd = 0.01 * float(np.abs(fine).max())
    noisy = record + sd * rng.standard_normal(record.size)
    noisy.attrs = fine.attrs
    decay = find_free_decay(noisy, SYSTEM)
    assert not decay.evenly_spaced
    np.testing.assert_allclose(decay.start_time + decay.time, record["time"].values[-decay.time.size :])
    result = WAVEFORM.fit(decay, WAVEFORM.default_prior(decay), peaks="highest")
    truth = FRICTION / SYSTEM.force_factor(quantity_named(quantity))
    assert abs(result.coefficient.mean() - truth) < 4.0 * result.coefficient.std()
    assert result.noise_sd == pytest.approx(sd, rel=0.4)


def test_improper_prior_has_no_draws(rng: np.random.Generator) -> None:
    decay = find_free_decay(short_decay(friction=FRICTION), SYSTEM)
    prior = {"coefficient_precision": 0.0, "alpha": 0.0, "beta": 0.0}
    result = WAVEFORM.fit(decay, prior, peaks="highest")
    assert math.isfinite(result.coefficient.std())
    with pytest.raises(InputError, match="improper"):
        result.target.prior_draws(rng, 3)


@pytest.mark.parametrize(
    ("quantity", "noise_sd", "reported"),
    [("velocity", 1e-3, False), ("acceleration", 1e-3, False), ("acceleration", 0.3, True)],
)
def test_says_where_the_signal_jumps(quantity: str, noise_sd: float, reported: bool) -> None:
    """Samples near a turning point do not count; with so much noise others may lie at one."""
    decay = find_free_decay(short_decay(friction=FRICTION, noise_sd=noise_sd, quantity=quantity), SYSTEM)
    notes = WAVEFORM.fit(decay, WAVEFORM.default_prior(decay), peaks="highest").notes
    assert any("jumps at its turning points" in note for note in notes) is reported


@pytest.mark.parametrize("quantity", QUANTITIES[:2])
def test_samples_that_are_read_once_lead_to_the_optimum(quantity: str) -> None:
    """Of densely sampled records; another step would be shorter than a thousandth of a standard deviation."""
    record = simulate(
        SYSTEM,
        friction=FRICTION,
        initial_displacement=30.0 * FRICTION / SYSTEM.stiffness,
        duration=8.0,
        sampling_rate=1000.0,
        quantity=quantity,
    )
    sd = 0.05 * float(np.abs(record).max())
    rng = np.random.default_rng(3)
    decay = find_free_decay(record + sd * rng.standard_normal(record.size), SYSTEM)
    order, samples = decay.quantity.order, Samples(decay.values.size, EVENLY)
    fits = fit_waveforms(decay.values[None], decay.located, order, 0.0)
    kappa, stop = float(fits.kappa[0]), int(fits.stop[0])
    p = fits.coefficients[0] + np.linalg.solve(fits.normal[0], fits.gradient[0])
    jacobian, _ = signal_derivatives(samples, order, p, kappa, stop)
    gradient = jacobian.T @ (decay.values - signals(samples, order, p[None], kappa, stop)[0])
    left = gradient @ np.linalg.solve(jacobian.T @ jacobian, gradient) / sd**2
    assert left < 1e-6
    # the step that the regression takes is longer: the samples were read before it
    taken = fits.gradient[0] @ np.linalg.solve(fits.normal[0], fits.gradient[0]) / sd**2
    assert taken > left
