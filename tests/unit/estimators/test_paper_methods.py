"""The paper's two methods as estimators: what goes in, in which unit it comes out, what they say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from decays import SYSTEM
from friction_bayes import Pendulum, estimate, simulate
from friction_bayes.conjugate.gamma_exponential import GammaExponential
from friction_bayes.conjugate.normal_gamma import NormalGamma
from friction_bayes.core.quantities import QUANTITIES
from friction_bayes.decay.free_decay import FreeDecay
from friction_bayes.decay.friction_samples import friction_samples
from friction_bayes.estimators.paper_methods import GammaExponentialEstimator, NormalGammaEstimator
from friction_bayes.estimators.registry import ESTIMATORS

FRICTION = 0.07


def coulomb_decay(rng: np.random.Generator, quantity: str = "displacement", noise: float = 1e-5) -> FreeDecay:
    """The paper's testbed at 200 Hz, 20 periods from 0.0147 m, straight from the piecewise solution."""
    kind = QUANTITIES[quantity]
    time = np.arange(2500) / 200.0
    theta = SYSTEM.natural_frequency * time
    d = FRICTION / SYSTEM.stiffness
    half = np.floor(theta / np.pi)
    amplitude = 0.0147 - (2.0 * half + 1.0) * d
    scale = SYSTEM.natural_frequency**kind.order
    signal = {
        "displacement": amplitude * np.cos(theta) + d * (-1.0) ** half,
        "acceleration": -scale * amplitude * np.cos(theta),
    }[quantity]
    return FreeDecay(
        name="test",
        values=signal + noise * scale * rng.standard_normal(time.size),
        start_time=0.0,
        step=1.0 / 200.0,
        quantity=kind,
        unit=kind.unit,
        system=SYSTEM,
        frequency=SYSTEM.natural_frequency,
        phase=0.0,
        rest_position=0.0,
        stops=False,
    )


@pytest.mark.parametrize("peaks", ["highest", "nominal"])
@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_normal_gamma_is_the_pair_on_friction_samples(
    quantity: str, peaks: str, rng: np.random.Generator
) -> None:
    decay, method = coulomb_decay(rng, quantity), NormalGammaEstimator()
    fit = method.fit(decay, method.default_prior(decay), peaks=peaks)
    samples = friction_samples(decay, peaks)
    assert fit.posterior == NormalGamma(**method.default_prior(decay)).update(samples)
    assert fit.amplitudes == samples.size + 1
    factor = SYSTEM.force_factor(decay.quantity)
    assert factor * fit.coefficient.mean() == pytest.approx(fit.posterior.mu)
    assert factor * fit.coefficient.mean() == pytest.approx(FRICTION, rel=0.05)
    assert fit.precision.mean() == pytest.approx(fit.posterior.alpha / fit.posterior.beta)
    assert fit.precision_unit == "1/N^2"
    assert np.array_equal(fit.target.observed, samples)
    assert any("too wide" in note for note in fit.notes)


def test_gamma_exponential_says_what_it_estimates(rng: np.random.Generator) -> None:
    decay, method = coulomb_decay(rng, noise=5e-4), GammaExponentialEstimator()
    prior = method.default_prior(decay) | {"alpha": 1.0}
    fit = method.fit(decay, prior, peaks="nominal")
    samples = friction_samples(decay, "nominal")
    assert fit.posterior == GammaExponential(**prior).update(samples)
    assert fit.coefficient.mean() * SYSTEM.stiffness == pytest.approx(fit.posterior.friction.mean())
    assert fit.precision is None
    assert any("tends to 1 over the mean" in note for note in fit.notes)
    assert any("samples are negative" in note for note in fit.notes) == bool(np.any(samples < 0.0))


def test_an_uncalibrated_signal_keeps_its_own_unit(rng: np.random.Generator) -> None:
    volts, method = replace(coulomb_decay(rng), unit="V"), NormalGammaEstimator()
    fit = method.fit(volts, method.default_prior(volts), peaks="highest")
    assert fit.coefficient.mean() == fit.posterior.mu
    assert fit.coefficient.mean() == pytest.approx(FRICTION / SYSTEM.stiffness, rel=0.05)
    assert fit.precision_unit == "1/V^2"


def test_both_are_registered_and_name_their_keys() -> None:
    assert ESTIMATORS["normal-gamma"].prior_keys == ("mu", "lam", "alpha", "beta")
    assert ESTIMATORS["gamma-exponential"].prior_keys == ("alpha", "kappa")


@pytest.mark.parametrize("quantity", ["angle", "angular_velocity"])
def test_large_swings_do_not_pass_for_a_wrong_system(quantity: str) -> None:
    """At 0.9 rad a pendulum swings 5 % slower than in small swings; that is no disagreement."""
    system = Pendulum(inertia=0.02, stiffness=2.0)
    record = simulate(
        system, friction=0.004, initial_displacement=0.9, duration=6.0, sampling_rate=200.0, quantity=quantity
    )
    found = estimate(record, system, method="normal-gamma")
    assert found.frequency == pytest.approx(10.0, rel=2e-3)
    assert found.friction_over_stiffness.mean() == pytest.approx(0.002, rel=0.02)


def test_one_friction_sample_is_said_to_leave_the_width_to_the_prior(rng: np.random.Generator) -> None:
    decay = coulomb_decay(rng)
    short = replace(decay, values=decay.values[:400])
    estimator = NormalGammaEstimator()
    fit = estimator.fit(short, estimator.default_prior(short), peaks="nominal")
    assert fit.amplitudes == 2
    assert "prior's" in fit.notes[0]
    assert "prior's" not in estimator.fit(decay, estimator.default_prior(decay), peaks="nominal").notes[0]
