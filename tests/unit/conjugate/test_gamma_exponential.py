"""Eqs. (9)-(11), the formal likelihood, and what the pair really estimates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import integrate

from friction_bayes.conjugate.gamma_exponential import GammaExponential, negative_share
from friction_bayes.conjugate.likelihood import exponential_log_likelihood
from friction_bayes.core.errors import InputError

PRIOR = GammaExponential(alpha=2.0, kappa=0.3)
SAMPLES = np.array([0.2, -0.05, 0.1])


def test_update_by_hand() -> None:
    after = PRIOR.update(SAMPLES)
    assert after.alpha == 5.0
    assert after.kappa == pytest.approx(0.55, rel=1e-14)
    assert after.friction.mean() == pytest.approx(5.0 / 0.55)


def test_posterior_and_evidence_against_quadrature() -> None:
    def joint(r: float) -> float:
        return math.exp(float(PRIOR.logpdf(r)) + float(exponential_log_likelihood(r, n=3, total=0.25)))

    evidence = integrate.quad(joint, 0.0, np.inf, epsabs=0.0, epsrel=1e-12)[0]
    assert PRIOR.log_evidence(SAMPLES) == pytest.approx(math.log(evidence), abs=1e-10)
    assert joint(7.0) / evidence == pytest.approx(PRIOR.update(SAMPLES).friction.pdf(7.0), rel=1e-10)
    assert PRIOR.logpdf(7.0) == pytest.approx(PRIOR.friction.logpdf(7.0), abs=1e-12)
    assert PRIOR.logpdf(-1.0) == -np.inf


def test_evidence_by_the_chain_rule() -> None:
    apart = PRIOR.log_evidence(SAMPLES[:2]) + PRIOR.update(SAMPLES[:2]).log_evidence(SAMPLES[2:])
    assert PRIOR.log_evidence(SAMPLES) == pytest.approx(apart, abs=1e-12)


def test_it_goes_to_one_over_the_friction(rng: np.random.Generator) -> None:
    samples = rng.normal(0.07, 0.17, 100_000)
    mean = GammaExponential(0.01, 1e-5).update(samples).friction.mean()
    assert mean == pytest.approx(1.0 / 0.07, rel=0.04)  # five standard errors


def test_interval_kinds() -> None:
    shortest, tailed = PRIOR.friction_interval(0.9, "highest-density"), PRIOR.friction_interval(0.9)
    assert shortest[1] - shortest[0] < tailed[1] - tailed[0]
    assert tailed == pytest.approx(PRIOR.friction.interval(0.9))


def test_negative_share() -> None:
    assert negative_share(SAMPLES) == pytest.approx(1.0 / 3.0)
    assert negative_share([]) == 0.0


def test_too_negative_samples_are_refused() -> None:
    with pytest.raises(InputError, match=r"kappa \+ sum = -0.2 is not positive, 50 % of the samples"):
        PRIOR.update([0.1, -0.6])


def test_flat_prior_updates_but_is_no_distribution(rng: np.random.Generator) -> None:
    flat = GammaExponential(0.0, 0.0)
    assert flat.update(SAMPLES).alpha == 3.0
    for refused in (
        lambda: flat.friction,
        lambda: flat.logpdf(1.0),
        lambda: flat.log_evidence(SAMPLES),
        lambda: flat.rvs(2, rng),
    ):
        with pytest.raises(InputError, match="is improper and has no"):
            refused()
    with pytest.raises(InputError, match="kappa: -1 is negative"):
        GammaExponential(1.0, -1.0)


def test_draws(rng: np.random.Generator) -> None:
    draws = PRIOR.rvs(40_000, rng)
    assert draws.mean() == pytest.approx(2.0 / 0.3, abs=5.0 * math.sqrt(2.0) / 0.3 / 200.0)
